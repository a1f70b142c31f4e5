"""Step 2: scans that tracking may have slipped with are no keyframes."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.poses import Array, compose, relative
from nscan_cli.slam.frontend.options import TrackingOptions
from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from nscan_cli.slam.frontend.tracker import Tracker
from nscan_cli.slam.keyframes.keyframe_selection import Keyframes, SlipDetector
from nscan_cli.slam.keyframes.options import KeyframeOptions
from tests.benchmarks.robustness import false_loops, mapped, undisturbed
from tests.data import data_file
from tests.ndt.wall_points import room
from tests.slam.mapped_logs import sensed

OPTIONS = KeyframeOptions(slip_sigmas=1.5)
SLIPPED = [(0.1, 0.90), (1.6, 0.82), (0.7, 0.84), (2.1, 0.81), (0.7, 0.77), (2.0, 0.83), (0.2, 0.91)]
"""How far off and what share of the points fits: one scan slips, and four more until the track is back."""


def found_with(off: Array, inliers: Array, poses: Array | None = None) -> TrackedScans:
    found = TrackedScans.room(len(off))
    for column in found:
        column[:] = 0
    found.odometry_sigmas[:], found.inliers[:] = off, inliers
    if poses is not None:
        found.poses[:], found.paths[:] = poses, np.arange(len(off))
    return found


def test_from_a_slip_on_until_as_much_fits_again():
    found = found_with(*np.transpose(SLIPPED))
    assert SlipDetector(OPTIONS).find(found).tolist() == [False, True, True, True, True, True, False]


@pytest.mark.parametrize("one", [(9.0, 0.9 - 0.9 * OPTIONS.slip_inlier_drop), (1.4, 0.5)])
def test_neither_a_spinning_wheel_nor_a_new_view_alone_is_a_slip(one):
    found = found_with(*np.transpose([SLIPPED[0], one, SLIPPED[0]]))
    assert not SlipDetector(OPTIONS).find(found).any()


def test_less_of_what_follows_a_new_view_is_measured_by_that():
    """What fits of the first scan is long past when the third slips."""
    found = found_with(*np.transpose([(0.1, 0.9), (0.1, 0.6), (1.6, 0.58), (1.6, 0.5)]))
    assert SlipDetector(OPTIONS).find(found).tolist() == [False, False, False, True]


@given(
    st.lists(st.tuples(st.floats(0, 4), st.floats(0.2, 1.0)), min_size=1, max_size=30),
    st.lists(st.integers(1, 29), max_size=4),
)
def test_however_many_scans_come_at_a_time(scans, cuts):
    found, several = found_with(*np.transpose(scans)), SlipDetector(OPTIONS)
    ends = [0, *sorted(cut for cut in set(cuts) if cut < len(scans)), len(scans)]
    parts = [several.find(found.part(a, b)) for a, b in itertools.pairwise(ends)]
    np.testing.assert_array_equal(np.concatenate(parts), SlipDetector(OPTIONS).find(found))


@pytest.mark.parametrize(
    ("ahead", "slipped", "rows"),
    [(0.4, 0, [0, 3, 6, 9]), (0.4, 5, [0, 6, 9]), (0.4, 9, [0, 6, 10]), (0.3, 5, [0, 6, 10])],
)
def test_what_may_have_slipped_is_a_keyframe_only_where_it_is_twice_as_far(ahead, slipped, rows):
    """Keyframes 1 m apart: scans 1, 2, ... of a slip are none until it ends, or 2 m are over."""
    poses = np.array([[ahead * k, 0.0, 0.0] for k in range(12)])
    off, inliers = np.zeros(12), np.full(12, 0.9)
    off[1 : 1 + slipped], inliers[1 : 1 + slipped] = 2.0, 0.7
    keyframes = Keyframes(KeyframeOptions(distance=1.0, turn=0.5), GaussianOptions(cell=1.0, minimum=4))
    keyframes.select(sensed([room(k) for k in range(12)]), found_with(off, inliers, poses))
    assert [keyframe.row for keyframe in keyframes.list] == rows


def test_tracking_says_how_far_off_the_odometry_a_scan_lies():
    """In a room that is stood in, odometry that says 0.3 m is 0.05 m + 0.2 · 0.3 m unsure of it."""
    odometry = np.array([[2.0, 1.0, 0.7]] * 3)
    odometry[2] = compose(odometry[1], np.array([0.3, 0.0, 0.0]))
    scans = sensed([room(1)] * 3, odometry)
    found = Tracker(TrackingOptions()).track(scans)
    assert found.odometry_sigmas[:2] == pytest.approx(0.0, abs=0.02)
    moved = relative(found.poses[2], found.poses[0])
    assert found.odometry_sigmas[2] == pytest.approx(np.hypot(moved[0] - 0.3, moved[1]) / 0.11)
    assert found.odometry_sigmas[2] > 2.5
    without = Tracker(TrackingOptions(), odometry=False).track(replace(scans, odometry=None))
    np.testing.assert_array_equal(without.odometry_sigmas, 0.0)


def test_along_the_campus_no_loop_is_closed_where_the_track_slips():
    """Seed 9: the odometry says 1.30 m, the robot went 1.11, the scan fits best at 1.76."""
    data_file("fr-campus.log.gz")
    truth = undisturbed("fr-campus")
    assert false_loops(mapped("fr-campus", 9, 0, "both"), truth) == 0
