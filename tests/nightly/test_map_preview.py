from __future__ import annotations

import io
import re

import numpy as np
import pytest
from PIL import Image

from nscan_cli.graph.model import Graph, Loop
from nscan_cli.mapping.figures.map_plots import SOFT_GRAYS
from nscan_cli.mapping.occupancy import FREE, OCCUPIED, UNKNOWN
from nscan_cli.nightly import map_preview as module
from nscan_cli.nightly.map_preview import map_preview
from tests.mapping.grids import grid_of_counts


def graph_of(poses: list[tuple[float, float, float]]) -> Graph:
    count = len(poses)
    return Graph(
        scans=np.arange(count),
        stamps=[str(k) for k in range(count)],
        poses=np.array(poses, dtype=np.float64),
        odometry=None,
        anchors=np.arange(count),
        loops=[Loop((0, 1), True, "", 1.0), Loop((1, 2), False, "", 0.0)],
    )


@pytest.fixture
def grid():
    """5 rows of 4 cells of 0.5 m from (1, 2) on: one occupied at the lower left, the right half unknown."""
    hits, misses = np.zeros((5, 4), dtype=np.int32), np.zeros((5, 4), dtype=np.int32)
    misses[:, :2] = 1
    hits[0, 0] = 5
    return grid_of_counts(hits, misses, 0.5, (1.0, 2.0))


GRAPH = graph_of([(1.0, 2.0, 0), (2.0, 4.5, 0), (3.0, 2.0, 0)])
"""At the lower left, the upper middle and the lower right of the grid."""


def test_the_picture_has_a_pixel_for_each_cell(grid):
    pixels = np.asarray(Image.open(io.BytesIO(map_preview(grid, GRAPH)[0])).convert("L"))
    occupied, free, unknown = (SOFT_GRAYS[state] for state in (OCCUPIED, FREE, UNKNOWN))
    assert pixels.tolist() == [
        *[[free, free, unknown, unknown]] * 4,
        [occupied, free, unknown, unknown],
    ]


def test_a_wall_is_seen_where_cells_share_a_pixel(grid, monkeypatch):
    monkeypatch.setattr(module, "PREVIEW_PIXELS", 3)
    picture, layers = map_preview(grid, GRAPH)
    pixels = np.asarray(Image.open(io.BytesIO(picture)).convert("L"))
    occupied, free, unknown = (SOFT_GRAYS[state] for state in (OCCUPIED, FREE, UNKNOWN))
    # Filled up above: the lower left corner keeps its place.
    assert pixels.tolist() == [[free, unknown], [free, unknown], [occupied, unknown]]
    assert 'viewBox="0 0 2 3"' in layers.decode()


def test_the_layers_lie_over_the_picture(grid):
    layers = map_preview(grid, GRAPH)[1].decode()
    assert 'viewBox="0 0 4 5"' in layers

    def path(name: str) -> str:
        found = re.search(rf'class="{name}" fill="none" d="([^"]*)"', layers)
        assert found
        return found[1]

    assert path("path") == "M0.0 5.0L2.0 0.0L4.0 5.0L4.0 5.0"
    assert path("loops") == "M0.0 5.0L2.0 0.0"
    assert path("refused") == "M2.0 0.0L4.0 5.0"
    # 0.2 m of the 2 m of the map's width are 0.4 pixels: the greatest round length in its fifth.
    assert path("scale").endswith("H0.5v-0.1")
    assert ">0.2 m</text>" in layers


def test_the_path_leaves_out_what_nobody_can_see(grid):
    dense = graph_of([(1.0 + 0.001 * k, 2.0, 0.0) for k in range(2001)])
    layers = map_preview(grid, dense)[1].decode()
    (path,) = re.findall(r'class="path"[^>]*', layers)
    assert path.count("L") <= 3
