"""What the surroundings of a Gaussian tell: that a wall only ends in its block."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.ndt.energy import energy
from nscan_cli.ndt.hash_grid import NO_NEIGHBOURS, WALL_END
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, compose, relative
from tests.simulation.laser import Laser
from tests.simulation.scenes import bare_corridor

HERE = np.zeros(3)
FRAMES = [HERE, np.array([-3.1, 0.7, 0.5]), np.array([5.3, 2.2, 2.3])]
"""Walls along an axis of the grid, and not."""
ALONG, ACROSS = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])


def wall(*places: tuple[float, float], seed: int = 1) -> Array:
    """Points (n, 2) on a line from place to place, 1 cm apart, with noise of 5 mm."""
    rng = np.random.default_rng(seed)
    parts = []
    for a, b in itertools.pairwise(places):
        count = round(float(np.hypot(b[0] - a[0], b[1] - a[1])) * 100)
        parts.append(np.linspace(a, b, count, endpoint=False))
    points = np.concatenate(parts)
    return points + 0.005 * rng.standard_normal(points.shape)


def ndt_of(points: Array, around: int, frame: Array = HERE) -> Ndt:
    return Ndt.of_scans(
        points, np.array([0, len(points)]), frame[None], GaussianOptions(1.0, 5), neighbourhood=around
    )


def held(ndt: Ndt, points: Array, frame: Array, direction: Array) -> float:
    """The information of the energy in a direction (3,), in the frame of the walls."""
    hessian = energy(ndt, points, frame, exact=False).hessian
    turned = compose(np.array([0.0, 0.0, frame[2]]), direction) - np.array([0.0, 0.0, frame[2]])
    return float(turned @ hessian @ turned)


@pytest.mark.parametrize("frame", FRAMES, ids=["along", "half a radian", "backwards"])
@pytest.mark.parametrize("end", [3.6, 3.85, 4.1, 4.35])
def test_the_end_of_a_wall_holds_across_and_not_along(frame, end):
    """Blocks are 1 m wide and 0.5 m apart, so that the wall fills less than half of some."""
    points = wall((0.0, 2.0), (end, 2.0))
    last = points[points[:, 0] > end - 0.3]
    alone, open_ended = (ndt_of(points, around, frame) for around in (NO_NEIGHBOURS, WALL_END))
    # One that is filled whole has (12 · 0.02²)² of 1 / 0.02² along itself, and the noise of its direction.
    assert held(open_ended, last, frame, ALONG) < 1
    assert held(open_ended, last, frame, ACROSS) == pytest.approx(held(alone, last, frame, ACROSS), rel=0.2)


def test_alone_the_end_of_a_wall_holds_along():
    """Without the correction, the wall of the test above has far more information along it."""
    points = wall((0.0, 2.0), (4.1, 2.0))
    assert held(ndt_of(points, NO_NEIGHBOURS), points[points[:, 0] > 3.8], HERE, ALONG) > 1000


@pytest.mark.parametrize("frame", FRAMES, ids=["along", "half a radian", "backwards"])
@pytest.mark.parametrize(
    "places",
    [
        pytest.param([(2.0, 2.0), (2.08, 2.0), (2.08, 2.08), (2.0, 2.08), (2.0, 2.0)], id="post"),
        pytest.param([(0.0, 2.0), (2.1, 2.0), (2.1, 1.5)], id="corner"),
        pytest.param([(0.0, 2.0), (2.1, 2.0), (2.1, 2.15)], id="door post"),
    ],
)
def test_corners_keep_their_information(frame, places):
    """Only Gaussians that contain nothing but the end of one wall lose information."""
    points = wall(*places)
    alone, open_ended = (ndt_of(points, around, frame) for around in (NO_NEIGHBOURS, WALL_END))
    for direction in (ALONG, ACROSS):
        assert held(alone, points, frame, direction) > 1000
        assert held(open_ended, points, frame, direction) > 0.3 * held(alone, points, frame, direction)


def test_short_sighted_scans_are_not_pulled_together_along_a_corridor():
    """Two scans 1.8 m apart that see 4 m, where nothing tells the way: the energy's slope at the true poses.

    The rise of E for each metre of distance; the mean of 40 draws.
    """
    laser = Laser(360, -np.radians(120), np.radians(240) / 359, 4.0, noise=0.02, resolution=0.0)
    slopes: dict[int, list[float]] = {NO_NEIGHBOURS: [], WALL_END: []}
    for seed in range(40):
        # Anywhere in the grid.
        at = 0.5 * np.random.default_rng(seed).random(2)
        truth = np.array([[at[0], 0.1, 0.02], [at[0] + 1.8, -0.1, -0.03]])
        first, second = scans(bare_corridor().record_at(truth, seed, laser).log())
        for around, found in slopes.items():
            for ahead, here, there in ((1.0, first, second), (-1.0, second, first)):
                poses = truth if ahead > 0 else truth[::-1]
                pose = relative(poses[1], poses[0])
                gradient = energy(ndt_of(here, around), there, pose).gradient
                away = compose(np.array([0.0, 0.0, -poses[0, 2]]), np.array([ahead, 0.0, 0.0]))
                found.append(float(gradient[:2] @ away[:2]))
    assert np.mean(slopes[NO_NEIGHBOURS]) > 10
    assert abs(np.mean(slopes[WALL_END])) < np.mean(slopes[NO_NEIGHBOURS]) / 3


def scans(log: LaserLog) -> list[Array]:
    """The points of each scan, in its robot's frame."""
    points, ends = log.batch_points(slice(len(log)), 40.0)
    return [points[a:b] for a, b in itertools.pairwise(ends)]
