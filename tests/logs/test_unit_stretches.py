"""Stretches of a log in another unit: what is beyond doubt is put right, and what is likely is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.raw_scans import RawScans
from nscan_cli.logs.scan_order import by_time
from nscan_cli.logs.unit_stretches import UnitStretchOptions, in_one_unit
from nscan_cli.poses import Mask
from tests.logs import lines
from tests.logs.noisy_room import FIRST, SCANS, STEP, Readings, carmen, readings, recording

Read = Callable[..., LaserLog]
STRETCHES = {
    "25 to 39": np.arange(SCANS) >= 25,
    "0 to 5": np.arange(SCANS) < 6,
    "10 to 13, 20 to 29": np.isin(np.arange(SCANS), [*range(10, 14), *range(20, 30)]),
}


def mixed(rows: Mask, factor: float) -> Readings:
    found: Readings = readings() * np.where(rows, factor, 1.0)[:, None].astype(np.float32)
    return found


@pytest.mark.parametrize("names", STRETCHES)
@pytest.mark.parametrize(("factor", "unit"), [(1000.0, "millimetres"), (100.0, "centimetres")])
def test_stretches_in_another_unit_are_put_right_and_said(read: Read, names, factor, unit):
    log = read(recording(mixed(STRETCHES[names], factor)))
    expected = read(recording(readings()))
    np.testing.assert_allclose(log.ranges, expected.ranges, rtol=1e-5)
    assert log.range_limits == expected.range_limits
    (said,) = log.report.contradictions
    assert f"ranges of scans {names} are in {unit}, the others in metres: they are mult" in said
    assert "--as-recorded" in said


def test_their_limits_may_be_in_the_same_unit(read: Read):
    rows = STRETCHES["25 to 39"]
    written = recording(mixed(rows, 1000.0), range_max=9.9)
    other = recording(mixed(rows, 1000.0), range_min=50.0, range_max=9_900.0)
    both = [*written[:50], *other[50:]]
    log = read(both)
    np.testing.assert_allclose(log.ranges, read(recording(readings(), range_max=9.9)).ranges, rtol=1e-5)
    assert log.range_limits == pytest.approx((0.05, 9.9))


def test_a_log_as_recorded_keeps_its_readings(read: Read):
    log = read(recording(mixed(STRETCHES["25 to 39"], 1000.0)), as_recorded=True)
    assert not np.isfinite(log.ranges[30]).any()


def test_text_logs_too(tmp_path):
    log = lines.read(tmp_path, *carmen(np.round(mixed(STRETCHES["0 to 5"], 1000.0), 2)))
    np.testing.assert_allclose(log.ranges, readings(), atol=0.006)
    assert "of scans 0 to 5 are in millimetres" in log.report.contradictions[0]


def test_two_drives_of_different_rooms(read: Read):
    """No scan shows the change: what is usual in both decides."""
    ranges = readings()
    ranges[20:] = 1000.0 * np.roll(ranges[20:], 60, axis=1) * np.float32(0.7)
    log = read(recording(ranges))
    assert "ranges of scans 20 to 39 are in millimetres" in log.report.contradictions[0]
    np.testing.assert_allclose(log.ranges[30], ranges[30] / 1000.0, rtol=1e-5)


@pytest.mark.parametrize("factor", [3.281, 2.0, 0.3])
def test_another_factor_is_told(read: Read, factor):
    log = read(recording(mixed(STRETCHES["25 to 39"], factor), range_max=60.0))
    (said,) = log.report.contradictions
    assert "all ranges are multiplied from one scan to the next, at scan 25 by" in said
    assert "try --end 2.45, or --start 2.45" in said


def test_a_factor_that_no_unit_explains_is_told(read: Read):
    log = read(recording(mixed(STRETCHES["25 to 39"], 250.0)))
    assert "ranges of scans 25 to 39 are 269 times the others" in log.report.contradictions[0]


def test_codes_are_no_unit(read: Read):
    """Scans in which all beams but a few say 1000."""
    ranges = readings()
    ranges[25:, 5:] = 1000.0
    assert read(recording(ranges)).report.contradictions == ()


def test_a_laser_that_is_covered_is_no_unit(read: Read):
    """Most beams are near at once, each at its own distance."""
    ranges, rng = readings(), np.random.default_rng(3)
    ranges[25:] = rng.uniform(0.2, 0.8, ranges[25:].shape)
    assert read(recording(ranges)).report.contradictions == ()


def test_one_scan_beside_another_too_short_to_tell_is_no_stretch():
    """Found by Hypothesis: all scans were then in the other unit, and no change was there to be judged."""
    ranges = np.array([[1, 1, 1, 1, np.nan, np.nan], [1, 1, 100, 100, 100, 101]], dtype=np.float32)
    order = by_time(["0", "1"])
    raw = RawScans(ranges.copy(), np.full(2, FIRST), np.full(2, STEP), order.stamps, (0.0, 80.0))
    found, said = in_one_unit(raw, order)
    np.testing.assert_array_equal(found.ranges, ranges)
    assert said == []


def test_bounds_are_options():
    """With bounds that nothing fulfils nothing is found."""
    order = by_time([f"{0.1 * scan:.1f}" for scan in range(SCANS)])
    raw = RawScans(
        mixed(STRETCHES["25 to 39"], 2.0),
        np.full(SCANS, FIRST),
        np.full(SCANS, STEP),
        order.stamps,
        (0.0, 80.0),
    )
    assert in_one_unit(raw, order)[1]
    options = replace(UnitStretchOptions(), least_factor=3.0)
    assert in_one_unit(raw, order, options)[1] == []
