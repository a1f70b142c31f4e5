"""The arrays of an NDT, and the hash table that finds a lattice cell in them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.poses import Array

HALF_KEY = 1 << 30
"""Offset that makes lattice coordinates positive in a packed key."""
OUTDATED = -1.0
"""In place of the first number of Σ⁻¹: the Gaussian is to be made anew before it is met. `meet_again` does
so; before anything else looks Gaussians up, `Ndt.make` has to make them all."""


MINIMUM, FLOOR, AROUND, FACES = 0, 1, 2, 3
"""How Gaussians are made: of at least so many points, with at least this standard deviation (m), what their
surroundings tell of them, and whether they have faces (0 or 1); see gaussians.py."""
ALONE, STRAIGHT, OPEN = 0, 1, 2
"""What surroundings tell: nothing; the direction of a piece of wall; where it ends, and holds nothing along
itself; see surroundings.py."""


class Grid(NamedTuple):
    """The arrays of an NDT as the kernels take them. R rows, one for each lattice cell that was touched.

    While it grows, row r stands for its lattice cell and for the Gaussian of the block whose lower left
    cell it is, and row R + r of the Gaussians for the other face of a wall there; a compact one has the
    Gaussians that can be used and the cells that meet one.
    """

    table: NDArray[np.int32]
    """(T,) open-addressing hash table of rows, −1 where empty; T is a power of two."""
    keys: NDArray[np.int64]
    """(R,) packed lattice coordinates."""
    links: NDArray[np.int32]
    """(R, 4) rows of the Gaussians of the four blocks that the lattice cell is part of, or −1."""
    facing: Array
    """(R, 2) across what is in a lattice cell: beams against it count to the first part, others to the
    second."""
    sums: Array
    """(R, 2, 8) of both parts n, Σx, Σy, Σx², Σxy, Σy² about the centre of the lattice cell, and the sum of
    the unit vectors along the beams."""
    gaussians: Array
    """(G, 8) mean x, y; Σ⁻¹ as (xx, xy, yy), 0 where a Gaussian has too few points; the normal (x, y) of the
    face that it shows, 0 where it was seen from both sides; and the row of the one that shows the other
    face, or 0."""
    making: Array
    """(4,) MINIMUM, FLOOR, AROUND and FACES; (0,) in a compact one."""


@leaf_kernel
def table_size(rows: int) -> int:
    """Slots for so many rows: twice to four times as many, a power of two."""
    size = 2
    while size < 2 * rows:
        size *= 2
    return size


@kernel
def empty_grid(capacity: int, making: Array) -> Grid:
    """One with room for so many rows."""
    rows = max(capacity, 16)
    return Grid(
        np.full(table_size(rows), -1, dtype=np.int32),
        np.empty(rows, dtype=np.int64),
        np.empty((rows, 4), dtype=np.int32),
        np.empty((rows, 2)),
        np.empty((rows, 2, 8)),
        np.zeros((2 * rows, 8)),
        making,
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
def shown(grid: Grid, link: int, beam_x: float, beam_y: float) -> int:
    """The row of the Gaussian that shows its face to a beam of that direction, or −1.

    `link` is the row of its block's Gaussian, or −1.
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
def pack(ix: int, iy: int) -> int:
    """One key for the lattice cell (ix, iy)."""
    return (ix + HALF_KEY) * (2 * HALF_KEY) + (iy + HALF_KEY)


@leaf_kernel
def unpack(key: int) -> tuple[int, int]:
    """The lattice cell (ix, iy) of a key."""
    return key // (2 * HALF_KEY) - HALF_KEY, key % (2 * HALF_KEY) - HALF_KEY


@leaf_kernel
def _hash(key: int) -> int:
    mixed = np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)
    return int(mixed >> np.uint64(33))


@leaf_kernel
def insert(grid: Grid, rows: int, key: int) -> tuple[int, int]:
    """The row of a key, made when it is new; and the number of rows then."""
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
    """Enter the first `rows` keys into an empty table."""
    mask = grid.table.shape[0] - 1
    for row in range(rows):
        slot = _hash(grid.keys[row]) & mask
        while grid.table[slot] >= 0:
            slot = (slot + 1) & mask
        grid.table[slot] = row
