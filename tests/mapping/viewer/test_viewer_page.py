from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from nscan_cli.mapping.figures.map_plots import SOFT_GRAYS
from nscan_cli.mapping.occupancy import FREE, OCCUPIED, UNKNOWN, grid_of_counts
from nscan_cli.mapping.viewer.viewer_page import map_picture


@pytest.fixture
def grid():
    """5 rows of 4 cells of 0.5 m from (1, 2) on: one occupied at the lower left, the right half unknown."""
    hits, misses = np.zeros((5, 4), dtype=np.int32), np.zeros((5, 4), dtype=np.int32)
    misses[:, :2] = 1
    hits[0, 0] = 5
    return grid_of_counts(hits, misses, 0.5, (1.0, 2.0))


def test_the_picture_has_a_pixel_for_each_cell(grid):
    picture, bounds = map_picture(grid, 100)
    assert bounds == (1.0, 2.0, 3.0, 4.5)
    pixels = np.asarray(Image.open(io.BytesIO(picture)).convert("L"))
    occupied, free, unknown = (SOFT_GRAYS[state] for state in (OCCUPIED, FREE, UNKNOWN))
    assert pixels.tolist() == [
        *[[free, free, unknown, unknown]] * 4,
        [occupied, free, unknown, unknown],
    ]


def test_a_wall_is_seen_where_cells_share_a_pixel(grid):
    picture, bounds = map_picture(grid, 3)
    pixels = np.asarray(Image.open(io.BytesIO(picture)).convert("L"))
    occupied, free, unknown = (SOFT_GRAYS[state] for state in (OCCUPIED, FREE, UNKNOWN))
    # Filled up above: the lower left corner keeps its place.
    assert pixels.tolist() == [[free, unknown], [free, unknown], [occupied, unknown]]
    assert bounds == (1.0, 2.0, 3.0, 5.0)
