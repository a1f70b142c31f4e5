"""What the messages of a laser say of its turns, and which of that can be."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.logs.sweep import RecordedSweep, Sweep, sweep_of_file

SCANS, BEAMS = 50, 360
INCREMENT = 2 * np.pi / BEAMS


def sweep(
    increment: float | np.ndarray, scan_time: float, period: float, beams: int = BEAMS, raw: bool = False
) -> Sweep:
    told = RecordedSweep(np.full(SCANS, increment), np.full(SCANS, scan_time))
    sizes, times = np.full(SCANS, beams), np.linspace(0.0, period * (SCANS - 1), SCANS)
    return sweep_of_file(told, np.full(SCANS, INCREMENT), sizes, times, raw)


@pytest.mark.parametrize("turn", [0.1, -0.1, 0.19, 0.0134])
def test_times_that_can_be_are_believed(turn):
    found = sweep(turn / BEAMS, 0.2, 0.2)
    np.testing.assert_allclose(found.seconds, turn)
    assert not found.said
    assert found.origin == "time_increment of the messages"


def test_a_turn_is_longer_than_a_scan_of_a_part_of_it():
    np.testing.assert_allclose(sweep(0.1 / BEAMS, 0.1, 0.1, beams=240).seconds, 0.1)


@pytest.mark.parametrize(("told", "scan_time", "used", "by"), [
    (0.2 / 20, 0.2, 0.2, "scan_time"),
    (0.2 / 20, 0.0, 0.2, "the time between scans"),
    (0.2 / 20, 3.0, 0.2, "the time between scans"),
    (-0.2 / 20, 0.2, -0.2, "scan_time"),
    (2.0, 0.19, 0.19, "scan_time"),
])  # fmt: skip
def test_times_that_cannot_be_are_named_and_replaced(told, scan_time, used, by):
    """No laser turns a hundred times a second, and none is still turning when its next scan is there."""
    found = sweep(told / BEAMS, scan_time, 0.2)
    np.testing.assert_allclose(found.seconds, used)
    (said,) = found.said
    assert "time_increment of the messages is likely wrong" in said
    assert by in said
    assert "--sweep" in said
    recorded = sweep(told / BEAMS, scan_time, 0.2, raw=True)
    np.testing.assert_allclose(recorded.seconds, told)
    assert not recorded.said


@pytest.mark.parametrize("increment", [0.0, np.nan, 1e-9])
def test_nothing_said_is_seen_at_once(increment):
    """A simulated laser, or a 3D laser cut to a plane, has a scan_time too."""
    assert not sweep(increment, 0.2, 0.2).seconds.any()
    assert not sweep_of_file(None, np.ones(3), np.ones(3, dtype=np.int64), np.arange(3.0)).seconds.any()


def test_each_scan_has_its_own_time_unless_it_is_far_off():
    told = np.full(SCANS, 0.1 / BEAMS)
    told[:6] *= [1.1, 0.0, np.nan, 20.0, 0.01, -1.0]
    found = sweep(told, 0.0, 0.1).seconds
    np.testing.assert_allclose(found, [0.11, *[0.1] * (SCANS - 1)])
