"""Errors that a user can cause."""

from __future__ import annotations

import pickle

import pytest

from nscan_cli.errors import InputDataError, NscanError, OutputError
from nscan_cli.logs.device_choice import Device, OpenChoiceError
from nscan_cli.logs.recordings.mounting import MountingError

DEVICES = [Device(name, "sensor_msgs/msg/LaserScan", 10) for name in ("/front", "/rear")]
ERRORS = (
    OutputError("map.png: no space left"),
    InputDataError("a.log", "a record has no beams", "correct it", 3),
    MountingError("a.bag", "its laser nods", "try --mount"),
    OpenChoiceError("a.bag", "laser", DEVICES, "--topic", "message"),
)


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_an_error_comes_back_from_another_process_as_it_was(error):
    """One that could not be read again stops a pool of processes."""
    again = pickle.loads(pickle.dumps(error))
    assert isinstance(again, NscanError)
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert vars(again) == vars(error)
