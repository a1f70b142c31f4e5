"""A log's scans as points: one by one, and many at a time."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

from nscan_cli.errors import WrongUsageError
from nscan_cli.logs.beam_times import BeamTimes
from nscan_cli.logs.laser_log import SCANS_AT_ONCE, LaserLog
from nscan_cli.logs.log_excerpt import with_some_beams
from tests.logs.lines import flaser, read

SCANS, BEAMS = SCANS_AT_ONCE + 44, 6


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> LaserLog:
    """More scans than are computed at once, of lasers that turn, one of them blind."""
    random = np.random.default_rng(5)
    ranges = random.uniform(0.5, 9.0, (SCANS, BEAMS)).astype(np.float32)
    ranges[random.random(ranges.shape) < 0.2] = np.inf
    ranges[random.random(ranges.shape) < 0.2] = np.nan
    ranges[7] = np.nan
    lines = [flaser(float(k), (1.0,) * BEAMS) for k in range(SCANS)]
    read_back = read(tmp_path_factory.mktemp("scans"), *lines)
    return dataclasses.replace(
        read_back,
        ranges=ranges,
        angle_min=random.uniform(-3, 3, SCANS),
        angle_increment=random.uniform(0.1, 0.2, SCANS),
        mount=np.array([0.3, -0.1, 0.5]),
    )


def test_the_points_of_a_scan_are_its_usable_beams_in_the_robots_frame(log):
    """As seen from the robot: x = 0.3 + r cos(a + 0.5), y = −0.1 + r sin(a + 0.5)."""
    beams = np.flatnonzero(np.isfinite(log.ranges[3]))
    angles = log.angle_min[3] + log.angle_increment[3] * beams + 0.5
    expected = np.stack([np.cos(angles), np.sin(angles)], axis=-1) * log.ranges[3, beams, None]
    assert 0 < len(beams) < BEAMS
    np.testing.assert_allclose(log.points(3), expected + np.array([0.3, -0.1]), atol=1e-12)
    assert log.points(7).shape == (0, 2)


def test_many_at_a_time_are_the_same_to_the_bit(log):
    each = list(log.points_by_scan())
    assert len(each) == SCANS
    for row, points in enumerate(each):
        np.testing.assert_array_equal(points, log.points(row))


@pytest.mark.parametrize("size", [1, 7, SCANS, 10 * SCANS])
def test_stretches_are_of_so_many_scans_without_the_points_beyond_the_reach(log, size):
    found = []
    for first in range(0, SCANS, size):
        points, ends = log.batch_points(slice(first, first + size), 4.0)
        assert len(ends) <= size + 1
        assert (ends[0], ends[-1]) == (0, len(points))
        found += [points[begin:end] for begin, end in itertools.pairwise(ends)]
    assert len(found) == SCANS
    for row, points in enumerate(found):
        whole = log.points(row)
        np.testing.assert_array_equal(points, whole[np.hypot(whole[:, 0], whole[:, 1]) < 4.0])


def test_a_number_that_no_scan_has_is_wrong_usage(log):
    thinned = dataclasses.replace(log, numbers=2 * np.arange(SCANS))
    assert thinned.row(8) == 4
    for number in (7, 2 * SCANS):
        with pytest.raises(
            WrongUsageError, match=f"no scan {number}; scans read go from 0 to {2 * SCANS - 2}$"
        ):
            thinned.row(number)


def test_some_beams_are_where_they_were_and_seen_when_they_were(log):
    """Beams 0, 2 and 4 of 6; row 5 has 5 beams, and so three of these, row 6 has 4, and so two."""
    beams = np.full(SCANS, BEAMS)
    beams[5], beams[6] = 5, 4
    times = BeamTimes(np.full(SCANS, -0.1), np.full(SCANS, 0.02))
    log = dataclasses.replace(log, ranges=np.ones((SCANS, BEAMS), dtype=np.float32), beams=beams)
    log.ranges[5, 5:] = log.ranges[6, 4:] = np.nan
    thinned = with_some_beams(dataclasses.replace(log, beam_times=times), 2)
    assert thinned.beam_counts()[4:8].tolist() == [3, 3, 2, 3]
    for row in (4, 5, 6):
        points, _, seen = thinned.timed_points(slice(row, row + 1), 40.0)
        np.testing.assert_allclose(points, log.points(row)[::2], atol=1e-12)
        np.testing.assert_allclose(seen, (-0.1 + 0.02 * np.arange(beams[row]))[::2], atol=1e-12)


def test_the_times_are_those_of_the_points_within_reach(log):
    times = BeamTimes(np.full(SCANS, -0.1), np.full(SCANS, 0.02))
    timed = dataclasses.replace(log, beam_times=times)
    points, ends, seen = timed.timed_points(slice(0, 9), 4.0)
    expected, expected_ends = log.batch_points(slice(0, 9), 4.0)
    np.testing.assert_array_equal(points, expected)
    np.testing.assert_array_equal(ends, expected_ends)
    usable = [np.flatnonzero(np.isfinite(log.ranges[row])) for row in range(9)]
    near = [np.hypot(*log.points(row).T) < 4.0 for row in range(9)]
    beams = np.concatenate([beam[kept] for beam, kept in zip(usable, near, strict=True)])
    np.testing.assert_allclose(seen, -0.1 + 0.02 * beams, atol=1e-12)
