"""Places that are harder than an office."""

from __future__ import annotations

import numpy as np
import pytest

from tests.simulation.drive import Drive, Odometry, poses
from tests.simulation.laser import Laser
from tests.simulation.places import bare_corridors, drive_through, grounds, warehouse


@pytest.mark.parametrize("place", [bare_corridors, warehouse, grounds])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_way_is_clear_and_comes_back(place, seed):
    here = place(seed)
    way = poses(here.waypoints, Drive(1.0, 1.0, 0.4))
    assert here.world.clearance(way[:, :2]).min() > 0.35
    half = len(way) // 2
    nearest = [np.hypot(*(way[:half, :2] - at).T).min() for at in way[half:, :2]]
    assert np.mean(np.array(nearest) < 1.5) > 0.5


def test_grounds_lose_a_third_of_the_beams_and_see_walls_that_are_none():
    here, laser, how = grounds(1), Laser(181, max_range=50.0, dropout=0.02), Drive(1.0, 0.7, 1.0)
    recording = drive_through(here, laser, how, Odometry(), 1)
    lost = np.mean(recording.readings >= laser.no_return)
    assert 0.2 < lost < 0.5
    again = drive_through(here, laser, how, Odometry(), 1)
    np.testing.assert_array_equal(recording.readings, again.readings)
