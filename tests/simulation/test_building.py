"""The building for long logs: its rays against those of the exact caster, and its drives."""

from __future__ import annotations

import numpy as np

from nscan_cli.poses import compose
from tests.simulation.building import building, cells_of, first, follow, growing, rounds
from tests.simulation.laser import Laser, cast


def test_rays_through_the_grid_meet_what_rays_through_all_walls_meet():
    place, laser = building(2, 2), Laser()
    rng = np.random.Generator(np.random.PCG64(3))
    x, y = rng.uniform(-0.8, place.xs[-1], 12), rng.uniform(-0.8, 0.8, 12)
    robot = np.column_stack([x, y, rng.uniform(-np.pi, np.pi, 12)])
    origins = compose(robot, np.array(laser.mount))
    found, _ = follow(cells_of(place.world), origins, laser.angles(), laser.max_range)
    expected, _, _ = cast(place.world, robot, laser)
    expected[expected > laser.max_range] = np.inf
    # A ray that touches the very end of a wall may meet it for one and miss it for the other.
    assert np.isclose(found, expected, atol=1e-9).mean() > 0.999


def test_each_round_is_as_long_as_the_first():
    once, thrice = rounds(1), rounds(3)
    assert abs(len(thrice.times) - 3 * len(once.times)) < 20
    assert np.hypot(*(thrice.truth[len(once.times), :2] - once.truth[-1, :2])) < 0.5


def test_a_shorter_drive_is_the_beginning_of_a_longer_one():
    longer = growing(3000)
    assert len(longer.times) == 3000
    shorter = first(longer, 1000)
    assert np.array_equal(shorter.truth, longer.truth[:1000])
    assert len(set(np.round(longer.truth[:, 0]))) > 20
