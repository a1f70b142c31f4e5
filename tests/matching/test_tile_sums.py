"""Upper bounds of all tiles: against each by its definition, and no more of them than it takes."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from nscan_cli.matching.correlative_search import Search
from nscan_cli.matching.likelihood_field import TILE_SIDE, likelihood_field
from nscan_cli.matching.search_options import SearchOptions
from nscan_cli.matching.tile_sums import tile_sums


def plain(
    coarsest: NDArray[np.uint16], cells: NDArray[np.int32], reach: int
) -> dict[tuple[int, int, int], int]:
    """The sums that are not zero, by the angle and the first shift of the tile."""
    sums = {}
    for angle, (xs, ys) in enumerate(cells.tolist()):
        for ox in range(-reach, reach + 1, TILE_SIDE):
            for oy in range(-reach, reach + 1, TILE_SIDE):
                total = 0
                for x, y in zip(xs, ys, strict=True):
                    if 0 <= x + ox < coarsest.shape[0] and 0 <= y + oy < coarsest.shape[1]:
                        total += int(coarsest[x + ox, y + oy])
                if total:
                    sums[angle, ox, oy] = total
    return sums


@given(
    seed=st.integers(0, 2**32 - 1),
    size=st.tuples(st.integers(1, 70), st.integers(1, 70)),
    reach=st.integers(0, 70),
    spread=st.integers(1, 120),
)
def test_every_tile_has_the_sum_of_its_definition(seed, size, reach, spread):
    rng = np.random.default_rng(seed)
    coarsest = rng.integers(0, 700, size).astype(np.uint16)
    cells = rng.integers(-spread, spread, (3, 2, 20)).astype(np.int32)
    sums, first = tile_sums(coarsest, cells, reach)
    found = {
        (angle, first[0] + TILE_SIDE * i, first[1] + TILE_SIDE * j): int(sums[angle, i, j])
        for angle, i, j in np.argwhere(sums).tolist()
    }
    assert found == plain(coarsest, cells, reach)


def test_where_a_robot_may_be_anywhere_tiles_take_little_memory():
    """Two million tiles would take 15 MB by their scores; of these only some meet a map of 20 m."""
    rng = np.random.default_rng(3)
    scan, reference = rng.uniform(-10.0, 10.0, (2, 500, 2))
    anywhere = SearchOptions(distance=100.0, turn=np.pi, beams=180)
    field = likelihood_field(reference, anywhere)
    sums = Search(field, scan, np.zeros(3), anywhere)._tiles.sums
    assert sums.itemsize == 2
    across = (20.0 + 2 * np.hypot(10.0, 10.0)) / anywhere.cell / TILE_SIDE + 3
    assert max(sums.shape[1:]) <= across
    elsewhere = Search(field, scan, np.array([500.0, 0.0, 0.0]), anywhere)
    assert elsewhere._tiles.sums.size == 0
    assert elsewhere.best(0.0) is None
