"""Step 1: neighbouring points of a scan that are closer together than they need to be."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.slam.frontend.point_spacing import points_between, spaced_points
from nscan_cli.slam.options import SlamOptions
from tests.benchmarks.consistency import backwards
from tests.data import data_file
from tests.slam.mapped_logs import mapped


def wall_beside(noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """A wall 1 m to the right, from 4 m behind to 4 m ahead, in the order of 700 beams; the noise (700,)."""
    angles = np.linspace(-np.arctan(4.0), np.arctan(4.0), 700)
    wrong = np.random.default_rng(seed).normal(0, noise, len(angles))
    ranges = 1.0 / np.cos(angles) + wrong
    return np.column_stack([ranges * np.sin(angles), -ranges * np.cos(angles)]), wrong


@settings(deadline=None)
@given(st.floats(0.001, 0.3))
def test_points_kept_along_a_wall_are_as_far_apart_as_asked_for(spacing):
    points, _ = wall_beside(0.0)
    along, kept = points[:, 0], spaced_points(points, np.array([0, len(points)]), spacing, 4)
    assert kept.sum() <= 1.02 * 8.0 / spacing + 2
    assert np.diff(along[kept]).max() < spacing + 2 * np.diff(along).max()


def test_scans_are_looked_at_one_by_one():
    points, _ = wall_beside(0.0)
    one = spaced_points(points, np.array([0, len(points)]), 0.03, 4)
    both = spaced_points(np.concatenate([points, points]), np.array([0, 0, 700, 1400]), 0.03, 4)
    assert 200 < one.sum() < 320
    assert np.array_equal(both, np.tile(one, 2))


def test_the_noise_of_a_point_does_not_decide_whether_it_is_kept():
    """Points that lie too far on ahead, and too near behind, would turn the wall.

    The mean of the first point that is far enough from the last one kept is 3.5 mm off.
    """
    outward = []
    for seed in range(30):
        points, wrong = wall_beside(0.02, seed)
        kept = spaced_points(points, np.array([0, len(points)]), 0.03, 4)
        outward.append((wrong * np.sign(points[:, 0]))[kept].mean())
    assert abs(np.mean(outward)) < 0.001


def test_without_a_spacing_all_points_are_kept():
    points = np.zeros((5, 2))
    assert spaced_points(points, np.array([0, 2, 5]), 0.0, 4).all()


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


@settings(deadline=None)
@given(arrays(np.float64, (12, 2), elements=st.floats(-2.0, 2.0)), st.floats(0.1, 3.0))
def test_points_between_neighbours_divide_gaps_that_are_short_enough_into_equal_steps(points, longest):
    options = GaussianOptions()
    between, spacing = points_between(points, options, longest), options.cell / (options.minimum + 1)
    for one, other in itertools.pairwise(points):
        gap = np.linalg.norm(other - one)
        if spacing < gap <= longest:
            parts = int(np.ceil(gap / spacing))
            expected = np.linspace(one, other, parts + 1)[1:-1]
            np.testing.assert_allclose(between[: parts - 1], expected, atol=1e-12)
            between = between[parts - 1 :]
    assert len(between) == 0
