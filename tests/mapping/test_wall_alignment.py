import math

import numpy as np
import pytest

from nscan_cli.mapping.occupancy import OccupancyGrid, grid_of_counts
from nscan_cli.mapping.wall_alignment import wall_alignment

SIZE = 0.05


def map_of(points: np.ndarray) -> OccupancyGrid:
    """A map of 30 × 30 m around the origin in which the cells of the points (N, 2) are occupied."""
    hits = np.zeros((600, 600), dtype=np.int32)
    columns, lines = np.floor((points + 15) / SIZE).astype(int).T
    hits[lines, columns] = 5
    return grid_of_counts(hits, np.zeros_like(hits), SIZE, (-15.0, -15.0))


def walls(turn: float) -> np.ndarray:
    """A rectangle of 12 × 8 m with a wall inside, turned about the origin."""
    t = np.linspace(0, 1, 2000)[:, None]
    ends = [((-6, -4), (6, -4)), ((6, -4), (6, 4)), ((6, 4), (-6, 4)), ((-6, 4), (-6, -4)), ((1, -4), (1, 4))]
    points = np.concatenate([(1 - t) * np.array(a) + t * np.array(b) for a, b in ends])
    c, s = math.cos(turn), math.sin(turn)
    rotated: np.ndarray = points @ np.array([[c, s], [-s, c]])
    return rotated


@pytest.mark.parametrize("degrees", [0.0, 0.37, -12.3, 30.0, 44.0, -44.9])
def test_the_walls_are_turned_back(degrees):
    turn = math.degrees(wall_alignment(map_of(walls(math.radians(degrees)))))
    assert abs(turn) <= 45
    # A turn by 90° more aligns them, too.
    assert (turn + degrees + 45) % 90 - 45 == pytest.approx(0, abs=0.1)


def test_most_walls_decide():
    diagonal = np.linspace(-4, 4, 2000)[:, None] * np.array([1.0, 1.0]) + [0, 1]
    turned = map_of(np.concatenate([walls(0.1), diagonal]))
    assert wall_alignment(turned) == pytest.approx(-0.1, abs=0.002)


def test_without_walls_nothing_turns():
    empty = np.zeros((5, 5), dtype=np.int32)
    assert wall_alignment(grid_of_counts(empty, empty + 1, SIZE, (0.0, 0.0))) == 0.0
