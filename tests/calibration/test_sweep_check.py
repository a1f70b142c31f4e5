"""The turn of a laser as its file has it, against the scans."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from nscan_cli.calibration.file_check import CheckedFile, checked_file
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.load import log_from, read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.benchmarks.lasers import turning
from tests.data import data_file
from tests.simulation.drive import Drive
from tests.simulation.office import office_way, office_world
from tests.simulation.other_forms import swept_mcap
from tests.simulation.sweeping import Turning, fine_path, record_swept

PERIOD, BEAMS = 0.2, 360


@functools.cache
def recording(turn: float, rate: float = 2.8, told: float | None = None) -> bytes:
    """A drive through the office with turns at a rate (rad/s); the file says that a turn takes `told` s."""
    path = fine_path(office_way()[:12], Drive(speed=0.22, turn_rate=rate))
    laser = turning(BEAMS, 3.5, 0.01, 0.01)
    drive = record_swept("office", office_world(), path, laser, Turning(PERIOD, turn), 1)
    return swept_mcap(drive, time_increment=None if told is None else told / BEAMS)


def checked(data: bytes, reading: ReadingOptions | None = None) -> CheckedFile:
    reading = reading or ReadingOptions()
    return checked_file(log_from(data, "office.mcap", reading), reading, FileCheckOptions())


@pytest.mark.parametrize(("turn", "rate", "told", "used", "said"), [
    (PERIOD, 2.8, None, None, ""),
    (0.0, 2.8, 0.0, None, ""),
    (PERIOD, 2.8, 0.0, PERIOD, "the laser turns for 0.2 s, though the file has no times of beams"),
    (PERIOD, 0.5, 0.0, PERIOD, "the laser turns for 0.2 s, though the file has no times of beams"),
    (PERIOD, 2.8, -PERIOD, PERIOD, "the readings are in the reverse order of time"),
    (-PERIOD, 0.5, PERIOD, -PERIOD, "the readings are in the reverse order of time"),
    (0.0, 2.8, PERIOD, 0.0, "the laser sees all beams at once, though the file has times of beams"),
])  # fmt: skip
def test_the_scans_say_whether_and_how_the_laser_turns(turn, rate, told, used, said):
    found = checked(recording(turn, rate, told))
    assert (found.reading.sweep is None) if used is None else found.reading.sweep == pytest.approx(used)
    if not said:
        assert found.messages == []
        return
    (message,) = found.messages
    assert message.startswith(said)
    assert f"--sweep {used:.3g}" in message if used else "--sweep off" in message
    if used:
        assert found.log.beam_times is not None
        np.testing.assert_allclose(found.log.beam_times.step, used / BEAMS, rtol=1e-4)
    else:
        assert found.log.beam_times is None


@pytest.mark.parametrize("reading", [ReadingOptions(as_recorded=True), ReadingOptions(sweep=-PERIOD)])
def test_what_the_user_says_is_not_asked(reading):
    found = checked(recording(PERIOD, 2.8, -PERIOD), reading)
    assert found.messages == []
    assert found.reading == reading
    assert found.log.beam_times is not None
    np.testing.assert_allclose(found.log.beam_times.step, -PERIOD / BEAMS, rtol=1e-4)


@pytest.mark.parametrize(("name", "used"), [
    ("field/rplidar-floor", -0.1338), ("field/rplidar-hallway.bag", -0.0695),
    ("field/urg-corridor-1.bag", None), ("field/old-index.bag", None),
    ("field/mocap.bag", None), ("strangers/sweep-none.mcap", None), ("strangers/posts.mcap", None),
])  # fmt: skip
def test_real_lasers(name, used):
    """The driver of the RPLIDAR turns the readings round, as its laser turns clockwise; its times stay."""
    log = read_log(str(data_file(name)))
    found = checked_file(log, ReadingOptions(), FileCheckOptions()).reading.sweep
    assert found is None if used is None else found == pytest.approx(used, abs=2e-4)
