"""Step 1: neighbouring points of a scan that are closer together than they need to be."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.slam.frontend.point_spacing import spaced_points
from nscan_cli.slam.options import SlamOptions
from tests.benchmarks.consistency import backwards
from tests.data import data_file
from tests.slam.mapped_logs import mapped


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.5))
def test_points_kept_are_apart_and_those_left_out_are_near_the_one_kept_before(seed, spacing):
    rng = np.random.default_rng(seed)
    sizes = rng.integers(0, 30, 4)
    points, ends = np.cumsum(rng.normal(0, 0.1, (sizes.sum(), 2)), axis=0), np.append(0, np.cumsum(sizes))
    kept = spaced_points(points, ends, spacing)
    for first, end in itertools.pairwise(ends):
        scan, chosen = points[first:end], np.flatnonzero(kept[first:end])
        assert not len(scan) or chosen[0] == 0
        assert (np.linalg.norm(np.diff(scan[chosen], axis=0), axis=1) >= spacing * (1 - 1e-9)).all()
        before = scan[chosen[np.searchsorted(chosen, np.arange(len(scan)), side="right") - 1]]
        assert (np.linalg.norm(scan - before, axis=1) <= spacing).all()


def test_without_a_spacing_all_points_are_kept():
    points = np.zeros((5, 2))
    assert spaced_points(points, np.array([0, 2, 5]), 0.0).all()


@pytest.mark.logs
def test_a_robot_that_drives_backwards_beside_a_wall_keeps_its_odometry():
    """The wall is 0.2 to 0.4 m away and has half of all beams. With all of them 0.9 m of 1.2 are lost."""
    log = backwards(read_log(str(data_file("field/urg-corridor-1.bag")), ReadingOptions()))
    found = mapped(log).graph.poses
    assert way(found) == pytest.approx(1.2, abs=0.07)
    every = SlamOptions()
    every = dataclasses.replace(every, tracking=dataclasses.replace(every.tracking, point_spacing=0.0))
    assert way(mapped(log, every).graph.poses) < 0.6


def way(poses: np.ndarray) -> float:
    """How far the robot came while odometry went 1.17 m, m."""
    return float(np.linalg.norm(poses[441, :2] - poses[381, :2]))
