"""A compact copy of the grid of an NDT, with the arrays that matching needs."""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.assign import assign
from nscan_cli.kernels.decorators import kernel
from nscan_cli.ndt.hash_grid import Grid, rehash, table_size


@kernel
def compacted(grid: Grid, rows: int) -> Grid:
    """The Gaussians of the first `rows` that have enough points, and the lattice cells in their blocks.

    Those of the other face of a wall follow all others. No points can be added to the copy.
    """
    capacity = grid.keys.shape[0]
    places, fronts, backs = np.full(rows, -1, dtype=np.int32), 0, 0
    for row in range(rows):
        if grid.gaussians[row, 2] != 0.0:
            places[row] = fronts
            fronts += 1
            backs += grid.gaussians[row, 7] > 0.0
    gaussians, back = np.empty((fronts + backs, 8)), fronts
    for row in range(rows):
        if places[row] >= 0:
            gaussian = gaussians[places[row]]
            assign(gaussian, grid.gaussians[row])
            if gaussian[7] > 0.0:
                gaussian[7] = back
                assign(gaussians[back], grid.gaussians[capacity + row])
                back += 1
    keys, links, kept = np.empty(rows, dtype=np.int64), np.empty((rows, 4), dtype=np.int32), 0
    for row in range(rows):
        is_used = False
        for block in range(4):
            link = grid.links[row, block]
            links[kept, block] = places[link] if link >= 0 else -1
            is_used |= links[kept, block] >= 0
        keys[kept] = grid.keys[row]
        kept += is_used
    compact = Grid(
        np.full(table_size(kept), -1, dtype=np.int32),
        keys[:kept].copy(),
        links[:kept].copy(),
        np.empty((0, 2)),
        np.empty((0, 2, 8)),
        gaussians,
        np.empty(0),
    )
    rehash(compact, kept)
    return compact
