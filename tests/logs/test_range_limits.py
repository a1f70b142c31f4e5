"""Which limits hold for a log's readings, where they are from, and what piles up at them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.mapping.occupancy import occupancy_grid
from tests.logs import lines
from tests.logs.noisy_room import carmen, readings, recording, way
from tests.logs.recordings.messages import Scan

PILE = ", at a peak of readings without return"


def some(ranges: np.ndarray, share: float) -> np.ndarray:
    """Which readings a laser loses, for no reason."""
    return np.random.default_rng(3).random(ranges.shape) < share


@pytest.mark.parametrize(
    ("code", "share"),
    [(12.0, 0.018), (12.0, 0.005), (float(np.nextafter(np.float32(12), np.float32(0))), 0.018),
     (11.9995, 0.018), (12.01, 0.018), (13.0, 0.018), (65.533, 0.018), (math.inf, 0.018)],
)  # fmt: skip
def test_what_is_written_where_nothing_was_met_is_no_return(read, code, share):
    """At the limit, just within or beyond it, and far beyond; other readings may lie as near to it."""
    ranges = readings()
    lost = some(ranges, share) | (ranges > 12)
    ranges[lost] = code
    log = read(recording(ranges))
    np.testing.assert_array_equal(np.isinf(log.ranges), lost | (ranges >= code))
    assert not np.isnan(log.ranges).any()
    if code <= 12:
        assert log.no_return == pytest.approx(code, abs=1e-5)
        assert log.report.used["range_max"] == f"range_max of the messages{PILE}"
    assert log.range_limits[1] == pytest.approx(min(code, 12), abs=1e-5)


def test_the_map_is_that_of_a_laser_that_says_infinite(read):
    """Where nothing was met nothing is cleared, and so no way through the walls."""
    ranges = readings()
    lost = some(ranges, 0.02) | (ranges > 12)
    maps = []
    for code in (12.0, math.inf):
        ranges[lost] = code
        grid = occupancy_grid(read(recording(ranges)), np.arange(len(ranges)), way(), resolution=0.1)
        maps.append((grid.states(), grid.origin))
    np.testing.assert_array_equal(maps[0][0], maps[1][0])
    assert maps[0][1] == maps[1][1]


def test_a_code_in_the_midst_of_far_readings_is_found_without_limits(read):
    ranges = np.minimum(readings(), np.float32(11.2) - np.abs(readings() % 1))
    lost = some(ranges, 0.02)
    ranges[lost] = 11.2
    log = read(recording(ranges, range_max=0.0))
    np.testing.assert_array_equal(np.isinf(log.ranges), lost)
    assert log.no_return == pytest.approx(11.2)
    assert log.report.used["range_max"] == "the no-return value found in the readings"


@pytest.mark.parametrize("decimals", [2, 3, 6])
def test_a_wall_at_the_limit_is_one(read, decimals):
    """A third of the readings are of a wall at range_max; those that fall short of it are within."""
    ranges = readings()
    wall = 12 + 0.01 * np.random.default_rng(2).standard_normal(ranges.shape)
    ranges[:, ::3] = np.round(wall, decimals)[:, ::3]
    log = read(recording(ranges))
    np.testing.assert_array_equal(np.isfinite(log.ranges), ranges <= 12)
    assert log.no_return is None


def test_limits_that_change_from_scan_to_scan_are_each_looked_at(read):
    written, lost = recording(readings()), []
    for at, one in enumerate(written):
        if isinstance(one.content, Scan):
            far = 8.0 if at % 4 == 1 else 12.0
            ranges = np.minimum(one.content.ranges, np.float32(far))
            lost.append(ranges == far)
            written[at] = one.with_scan(ranges=ranges, range_max=far)
    np.testing.assert_array_equal(np.isinf(read(written).ranges), lost)


def test_what_is_written_at_the_lower_limit_says_nothing(read):
    ranges = readings()
    lost = some(ranges, 0.02)
    ranges[lost] = 0.1
    log = read(recording(ranges, range_min=0.1, range_max=20.0))
    np.testing.assert_array_equal(np.isnan(log.ranges), lost)
    assert log.report.used["range_min"] == "range_min of the messages, at a peak of invalid readings"


def test_a_longer_range_that_is_asked_for_does_not_bring_the_code_back(read):
    ranges = np.minimum(readings(), np.float32(12))
    log = read(recording(ranges), max_range=20.0)
    np.testing.assert_array_equal(np.isinf(log.ranges), ranges == 12)
    # But where there are readings beyond it, they are what was asked for.
    ranges = readings()
    log = read(recording(ranges, range_max=10.0), max_range=20.0)
    assert np.isfinite(log.ranges).all()
    assert log.report.used["range_max"] == "--max-range"
    ranges[some(ranges, 0.05)] = 10.0
    log = read(recording(ranges, range_max=10.0), max_range=20.0)
    assert np.isfinite(log.ranges).all()


@pytest.mark.parametrize("unsaid", [0.0, -1.0, math.nan, math.inf])
def test_limits_that_say_nothing_are_not_used(read, unsaid):
    ranges = readings()
    log = read(recording(ranges, range_min=unsaid, range_max=unsaid))
    np.testing.assert_array_equal(log.ranges, ranges)
    assert (log.report.used["range_min"], log.report.used["range_max"]) == ("none in the messages",) * 2
    assert log.report.warnings == ()


def test_returns_beyond_range_max_are_told(read):
    log = read(recording(readings(), range_max=6.0))
    (warning,) = log.report.warnings
    assert "of the returns lie beyond 6 m (range_max of the messages) and are read as no return" in warning
    assert "give a larger --max-range" in warning
    assert read(recording(readings(), range_max=6.0), max_range=15.0).report.warnings == ()


@pytest.mark.parametrize("code", [81.83, 81.91, 50.0])
def test_a_limit_of_navigation_cuts_no_returns(tmp_path, code):
    ranges = np.round(readings(), 2)
    lost = some(ranges, 0.01)
    ranges[lost] = code
    log = lines.read(tmp_path, *carmen(ranges, "robot_front_laser_max 4.0"))
    np.testing.assert_array_equal(np.isinf(log.ranges), lost)
    (warning,) = log.report.warnings
    assert warning.startswith("PARAM robot_front_laser_max is 4 m, but ")
    assert "--max-range 4 would use it" in warning
    held = lines.read(
        tmp_path, *carmen(ranges, "robot_front_laser_max 4.0"), options=ReadingOptions(max_range=4.0)
    )
    assert held.range_limits == (0.0, 4.0)
    assert held.report.warnings == ()


@pytest.mark.parametrize("code", [0.0, 4.0, 4.01, 50.0, 81.91])
def test_a_limit_of_the_laser_holds(tmp_path, code):
    """Beyond it there is nothing but what stands for no return, and a stray reading."""
    ranges = np.round(readings(), 2)
    beyond = ranges >= 4
    ranges[beyond] = code
    ranges[0, :3] = 5.0, 7.5, 6.2
    log = lines.read(tmp_path, *carmen(ranges, "robot_front_laser_max 4.0"))
    beyond[0, :3] = True
    np.testing.assert_array_equal(np.isfinite(log.ranges), ~beyond)
    assert log.range_limits == (0.0, 4.0)
    assert log.report.used["range_max"].startswith("PARAM robot_front_laser_max")
    assert log.report.warnings == ()


def test_the_limit_of_the_front_laser_is_not_that_of_the_rear(tmp_path):
    ranges = np.minimum(np.round(readings(), 2), np.float32(8))
    log = carmen(ranges, "robot_front_laser_max 4.0", "robot_rear_laser_max 8.0")
    rear = lines.read(tmp_path, *(line.replace("FLASER", "RLASER") for line in log))
    assert rear.range_limits == (0.0, 8.0)
    assert rear.report.used["range_max"] == f"PARAM robot_rear_laser_max{PILE}"


def test_a_greatest_range_in_the_records_is_tried_likewise(tmp_path):
    def robotlaser(ranges: np.ndarray) -> list[str]:
        head = "ROBOTLASER1 0 -3.141592653589793 6.248278722139589 0.03490658503988659 4.0 0.01 0 180"
        return [
            f"{head} {' '.join(f'{r:.2f}' for r in scan)} 0 0 0 0 0 0 0 0 0 0 0 0 {k}.0 h 0"
            for k, scan in enumerate(ranges.tolist())
        ]

    held = lines.read(tmp_path, *robotlaser(np.minimum(readings(), 4)))
    assert held.range_limits == (0.0, 4.0)
    assert held.report.used["range_max"] == f"the greatest range in ROBOTLASER1{PILE}"
    assert "angle" not in " ".join(held.report.warnings)
    longer = lines.read(tmp_path, *robotlaser(readings()))
    assert longer.range_limits == (0.0, 80.0)
    assert any("the greatest range in ROBOTLASER1 is 4 m, but" in w for w in longer.report.warnings)
