"""Tracking piece by piece; what breaks a track is tested on whole drives in test_trouble."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from nscan_cli.slam.following import Followed, Follower, Sensed
from nscan_cli.slam.options import BreakOptions, TrackingOptions
from tests.slam.drives import round_scene
from tests.slam.runs import part
from tests.slam.troubles import carried


@functools.cache
def scans() -> list[Sensed]:
    """40 scans of a drive, and 60 more after the robot was carried by 8 m."""
    made = carried(round_scene().record(5).log(), 20.0, 28.0)
    log = part(made.log, slice(made.before - 40, made.before + 60))
    assert log.odometry is not None
    return [Sensed(row, log.points(row), log.odometry[row]) for row in range(len(log))]


def followed(size: int) -> list[Followed]:
    """All scans, so many at a time."""
    follower, found = Follower(TrackingOptions(), BreakOptions()), []
    for first in range(0, len(scans()), size):
        found += follower.follow(scans()[first : first + size])
    return found + follower.finish()


@pytest.mark.parametrize("size", [1, 7, 64])
def test_a_track_breaks_where_it_does_however_many_scans_come_at_a_time(size):
    """Scans that were tracked ahead of a break are tracked anew, as of the piece that begins there."""
    found, together = followed(size), followed(len(scans()))
    assert [scan.row for scan in found] == list(range(len(scans())))
    assert [scan.row for scan in found if scan.breaks] == [40]
    for one, other in zip(found, together, strict=True):
        assert (one.begins, one.breaks) == (other.begins, other.breaks)
        np.testing.assert_array_equal(one.tracked.pose, other.tracked.pose)
        assert one.tracked.path == other.tracked.path


def test_when_all_is_tracked_the_map_goes_and_what_was_counted_stays():
    follower = Follower(TrackingOptions(), BreakOptions())
    follower.follow(scans())
    counted = follower.restarts, follower.searches
    assert counted > (0, 0)
    assert follower._tracker.map.rows > 0
    follower.finish()
    assert follower._tracker.map.rows == 0
    assert (follower.restarts, follower.searches) == counted
