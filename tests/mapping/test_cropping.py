import numpy as np
import pytest

from nscan_cli.errors import WrongUsageError
from nscan_cli.mapping.cropping import automatic_box, cropped_grid
from nscan_cli.mapping.occupancy import grid_of_counts


@pytest.fixture
def grid():
    """40 × 60 cells of 0.5 m from (−5, 2) on; the walls of a room, and one stray hit far to the right."""
    hits, misses = np.zeros((40, 60), dtype=np.int32), np.ones((40, 60), dtype=np.int32)
    hits[10, 10:31] = hits[30, 10:31] = 100
    hits[10:31, 10] = hits[10:31, 30] = 100
    hits[20, 58] = 2
    return grid_of_counts(hits, misses, 0.5, (-5.0, 2.0))


def test_a_rectangle_is_cut_out_at_cells(grid):
    part = cropped_grid(grid, (0.0, 7.0, 3.1, 9.0))
    assert part.bounds == (0.0, 7.0, 3.5, 9.0)
    assert part.hits.tolist() == grid.hits[10:14, 10:17].tolist()
    assert part.misses.tolist() == grid.misses[10:14, 10:17].tolist()
    assert part.states().tolist() == grid.states()[10:14, 10:17].tolist()


def test_what_is_outside_the_map_is_left_out(grid):
    assert cropped_grid(grid, (-100.0, -100.0, 100.0, 100.0)).bounds == grid.bounds
    with pytest.raises(
        WrongUsageError, match=r"--crop: leaves nothing of the map, which is from \(-5.0, 2.0\)"
    ):
        cropped_grid(grid, (30.0, 0.0, 40.0, 5.0))


def test_the_automatic_box_holds_the_room_and_no_stray_hit(grid):
    path = np.array([[1.0, 10.0], [5.0, 12.0]])
    assert automatic_box(grid, path) == pytest.approx((-0.5, 6.5, 11.0, 18.0))


def test_the_automatic_box_holds_the_path(grid):
    low_x, low_y, high_x, high_y = automatic_box(grid, np.array([[1.0, 10.0], [20.0, 12.0]]))
    assert (low_x, low_y, high_x, high_y) == pytest.approx((-0.5, 6.5, 20.5, 18.0))


def test_of_a_map_without_walls_the_path_is_left():
    empty = np.zeros((40, 40), dtype=np.int32)
    grid = grid_of_counts(empty, empty + 1, 0.5, (0.0, 0.0))
    assert automatic_box(grid, np.array([[5.0, 5.0], [6.0, 7.0]])) == (4.5, 4.5, 6.5, 7.5)
