"""The arrays of an NDT, and the hash table that finds lattice cells in them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.poses import Array, Indices

HALF_KEY = 1 << 30
"""Offset that makes lattice coordinates positive in a packed key."""
OUTDATED = -1.0
"""Stands for the first number of Σ⁻¹ of a Gaussian that has to be made again. `update_association` makes it.
Before any other look-up, `make_all_gaussians` has to make them."""
MINIMUM, FLOOR, NEIGHBOURHOOD, FACES = 0, 1, 2, 3
"""Places in `Grid.settings`: the least number of points of a Gaussian, its least standard deviation (m), the
use of its neighbourhood, and whether walls have two faces (0 or 1); see gaussians.py."""
MAX_NEIGHBOUR, MIN_SPACING, MAX_SPACING, SIDE_SHARE, ELONGATION, COSINE, END_SHARE, END_RATIO = range(4, 12)
"""The places of the fields of WallOptions."""
LEAST_RATIO = 12
"""The place of the least ratio of the smaller to the larger eigenvalue of a covariance."""
NO_NEIGHBOURS, WALL_DIRECTION, WALL_END = 0, 1, 2
"""Uses of the neighbourhood of a Gaussian, see neighbourhood.py. With NO_NEIGHBOURS there is none. With
WALL_DIRECTION it tells the direction of a wall. With WALL_END it tells where walls end; an end holds nothing
along the wall."""


class Grid(NamedTuple):
    """The arrays of an NDT as the kernels take them, with R rows, one for each lattice cell.

    While it grows, row r is that of a lattice cell and of the Gaussian of the block whose lower left cell it
    is. Row R + r of the Gaussians is the other face of a wall there. A compact grid has only Gaussians with
    enough points, and only cells that are part of their blocks.
    """

    table: NDArray[np.int32]
    """(T,) open-addressing hash table of rows, −1 where empty; T is a power of two."""
    keys: Indices
    """(R,) packed lattice coordinates."""
    links: NDArray[np.int32]
    """(R, 4) rows of the Gaussians of the four blocks that contain the lattice cell, or −1."""
    facing: Array
    """(R, 2) the normal of the surface in a lattice cell. Beams against it belong to the first part of the
    cell's sums, others to the second."""
    sums: Array
    """(R, 2, 8) the sums of both parts: n, Σx, Σy, Σx², Σxy, Σy² about the centre of the lattice cell, and
    the sum of the unit vectors along the beams."""
    gaussians: Array
    """(G, 8) the mean (x, y); Σ⁻¹ as (xx, xy, yy), 0 if there are too few points; the normal (x, y) of the
    face that was seen, 0 if both were; and the row of the Gaussian of the other face, 0 if there is none."""
    settings: Array
    """(13,) the options in the places above; (0,) in a compact grid."""


@leaf_kernel
def table_size(rows: int) -> int:
    """Number of hash slots for a number of rows: a power of two, twice to four times as many."""
    size = 2
    while size < 2 * rows:
        size *= 2
    return size


@kernel
def empty_grid(capacity: int, settings: Array) -> Grid:
    """A grid with capacity for a number of rows."""
    rows = max(capacity, 16)
    return Grid(
        np.full(table_size(rows), -1, dtype=np.int32),
        np.empty(rows, dtype=np.int64),
        np.empty((rows, 4), dtype=np.int32),
        np.empty((rows, 2)),
        np.empty((rows, 2, 8)),
        np.zeros((2 * rows, 8)),
        settings,
    )


@leaf_kernel
def find_row(grid: Grid, key: int) -> int:
    """The row of a packed key, or −1."""
    mask = grid.table.shape[0] - 1
    slot = _hash(key) & mask
    while True:
        row = grid.table[slot]
        if row < 0 or grid.keys[row] == key:
            return int(row)
        slot = (slot + 1) & mask


@leaf_kernel
def facing_gaussian(grid: Grid, link: int, beam_x: float, beam_y: float) -> int:
    """The row of the Gaussian whose face a beam of that direction hits, or −1.

    `link` is the row of the Gaussian of a block, or −1.
    """
    if link < 0 or grid.gaussians[link, 2] == 0.0:
        return -1
    if grid.gaussians[link, 5] * beam_x + grid.gaussians[link, 6] * beam_y <= 0.0:
        return link
    other = int(grid.gaussians[link, 7])
    if other > 0 and grid.gaussians[other, 5] * beam_x + grid.gaussians[other, 6] * beam_y <= 0.0:
        return other
    return -1


@leaf_kernel
def pack_key(ix: int, iy: int) -> int:
    """The key of the lattice cell (ix, iy)."""
    return (ix + HALF_KEY) * (2 * HALF_KEY) + (iy + HALF_KEY)


@leaf_kernel
def unpack_key(key: int) -> tuple[int, int]:
    """The lattice cell (ix, iy) of a key."""
    return key // (2 * HALF_KEY) - HALF_KEY, key % (2 * HALF_KEY) - HALF_KEY


@leaf_kernel
def _hash(key: int) -> int:
    mixed = np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)
    return int(mixed >> np.uint64(33))


@leaf_kernel
def insert_key(grid: Grid, rows: int, key: int) -> tuple[int, int]:
    """The row of a key, which is added if it is new, and the new number of rows."""
    mask = grid.table.shape[0] - 1
    slot = _hash(key) & mask
    while grid.table[slot] >= 0:
        row = grid.table[slot]
        if grid.keys[row] == key:
            return row, rows
        slot = (slot + 1) & mask
    grid.table[slot] = rows
    grid.keys[rows] = key
    grid.links[rows, :] = -1
    grid.sums[rows, :, :] = 0.0
    grid.gaussians[rows, :] = 0.0
    return rows, rows + 1


@leaf_kernel
def rehash(grid: Grid, rows: int) -> None:
    """Add the first `rows` keys to an empty table."""
    mask = grid.table.shape[0] - 1
    for row in range(rows):
        slot = _hash(grid.keys[row]) & mask
        while grid.table[slot] >= 0:
            slot = (slot + 1) & mask
        grid.table[slot] = row
