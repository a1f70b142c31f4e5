"""The normal distributions transform of points: built from one scan, grown by more ([19]; paper, III-F).

The plane is cut into four overlapping grids, shifted by half a cell against each other. Their common
refinement is a lattice of half cells: a point falls into one lattice cell, and the four Gaussians that it
meets are those of the 2 × 2 blocks of lattice cells around it. The sums of a point are therefore kept once,
in its lattice cell, and a Gaussian is made from the sums of its four. Sums can be taken away again, which
lets a map follow the robot.

One thing differs from [19]: the inverse of the larger eigenvalue λ is multiplied by the
ratio of the smaller to the larger. A round Gaussian stays what it is; a piece of wall, long and thin,
hardly holds a point along itself. How points are spread along a wall says where the beams fell, not where
the wall is: taken at its word, it drags the robot back in corridors, and the Hessian claims to know the
way along.

Another thing is added: a Gaussian knows from which side it was seen. A wall that is seen from a room and
from the corridor has two faces, 10 or 15 cm apart; matched with each other they pull the scans together by
that much. A beam that hits a Gaussian from behind therefore does not meet it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.compiled import kernel
from nscan_cli.poses import Array

HALF_KEY = 1 << 30
"""Offset that makes lattice coordinates positive in a packed key."""
ONE_SIDED = 0.2
"""A Gaussian shows one side when its beams run through it by so much of their length on average."""
NEW_NEIGHBOURS = 9
"""A point in new land creates at most its own lattice cell and the eight around it."""


class Grid(NamedTuple):
    """The arrays of an NDT as the kernels take them. R rows, one for each lattice cell that was touched.

    While it grows, row r stands for its lattice cell and for the Gaussian of the block whose lower left
    cell it is; a compact one has the Gaussians that can be used and the cells that meet one.
    """

    table: NDArray[np.int32]
    """(T,) open-addressing hash table of rows, −1 where empty; T is a power of two."""
    keys: NDArray[np.int64]
    """(R,) packed lattice coordinates."""
    links: NDArray[np.int32]
    """(R, 4) rows of the Gaussians of the four blocks that the lattice cell is part of, or −1."""
    sums: Array
    """(R, 8) n, Σx, Σy, Σx², Σxy, Σy² about the centre of the lattice cell, and the sum of the unit vectors
    along the beams."""
    gaussians: Array
    """(G, 7) mean x, y; Σ⁻¹ as (xx, xy, yy), 0 where a Gaussian has too few points; and the normal (x, y)
    of the side that it shows, 0 where it was seen from both."""


@kernel
def find_row(grid: Grid, key: int) -> int:
    """The row of a packed key, or −1."""
    mask = grid.table.shape[0] - 1
    slot = _hash(key) & mask
    while True:
        row = grid.table[slot]
        if row < 0 or grid.keys[row] == key:
            return int(row)
        slot = (slot + 1) & mask


@kernel
def pack(ix: int, iy: int) -> int:
    """One key for the lattice cell (ix, iy)."""
    return (ix + HALF_KEY) * (2 * HALF_KEY) + (iy + HALF_KEY)


@kernel
def _hash(key: int) -> int:
    mixed = np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)
    return int(mixed >> np.uint64(33))


@kernel
def _insert(grid: Grid, rows: int, key: int) -> tuple[int, int]:
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
    grid.sums[rows, :] = 0.0
    grid.gaussians[rows, :] = 0.0
    return rows, rows + 1


@kernel
def rehash(grid: Grid, rows: int) -> None:
    """Enter the first `rows` keys into an empty table."""
    mask = grid.table.shape[0] - 1
    for row in range(rows):
        slot = _hash(grid.keys[row]) & mask
        while grid.table[slot] >= 0:
            slot = (slot + 1) & mask
        grid.table[slot] = row


@kernel
def add_points(
    grid: Grid, rows: int, half: float, points: Array, pose: Array, sign: float, minimum: float, floor: float
) -> int:
    """Add (sign +1) or take away (−1) points (m, 2), moved by `pose`; returns the number of rows.

    Gaussians are made again where sums changed: from at least `minimum` points, with a standard
    deviation of at least `floor` (m) and a smaller eigenvalue of at least 0.001 of the larger ([19]).
    """
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    touched = np.empty(points.shape[0], dtype=np.int32)
    for k in range(points.shape[0]):
        x = cos * points[k, 0] - sin * points[k, 1] + pose[0]
        y = sin * points[k, 0] + cos * points[k, 1] + pose[1]
        ix, iy = int(np.floor(x / half)), int(np.floor(y / half))
        row = find_row(grid, pack(ix, iy))
        if row < 0 or grid.links[row].min() < 0:
            row, rows = _settle(grid, rows, ix, iy)
        touched[k] = row
        dx, dy = x - (ix + 0.5) * half, y - (iy + 0.5) * half
        sums = grid.sums[row]
        sums[0] += sign
        sums[1] += sign * dx
        sums[2] += sign * dy
        sums[3] += sign * dx * dx
        sums[4] += sign * dx * dy
        sums[5] += sign * dy * dy
        length = max(np.hypot(points[k, 0], points[k, 1]), 1e-9)
        sums[6] += sign * (x - pose[0]) / length
        sums[7] += sign * (y - pose[1]) / length
        if sums[0] < 0.5:
            sums[:] = 0.0
    previous = -1
    for k in range(points.shape[0]):
        # Neighbouring beams mostly fall into the same cell.
        if touched[k] != previous:
            previous = touched[k]
            for block in range(4):
                _make_gaussian(grid, grid.links[previous, block], half, minimum, floor)
    return rows


@kernel
def _settle(grid: Grid, rows: int, ix: int, iy: int) -> tuple[int, int]:
    """Make a lattice cell that gets its first point, and all cells that share a Gaussian with it."""
    centre = -1
    for dy in range(-1, 2):
        for dx in range(-1, 2):
            row, rows = _insert(grid, rows, pack(ix + dx, iy + dy))
            if dx == 0 and dy == 0:
                centre = row
            for block in range(4):
                bx, by = dx - block % 2, dy - block // 2
                if -1 <= bx <= 0 and -1 <= by <= 0:
                    block_row, rows = _insert(grid, rows, pack(ix + bx, iy + by))
                    grid.links[row, block] = block_row
    return centre, rows


@kernel
def _make_gaussian(grid: Grid, row: int, half: float, minimum: float, floor: float) -> None:
    """Mean, inverse covariance and side of the block of four lattice cells whose lower left one is `row`."""
    key = grid.keys[row]
    n = sx = sy = sxx = sxy = syy = fx = fy = 0.0
    for corner in range(4):
        ox, oy = corner % 2, corner // 2
        cell = row if corner == 0 else find_row(grid, key + ox * 2 * HALF_KEY + oy)
        if cell < 0 or grid.sums[cell, 0] == 0.0:
            continue
        part = grid.sums[cell]
        # The sums move from the cell's own centre to that of cell 0.
        dx, dy = ox * half, oy * half
        n += part[0]
        sx += part[1] + part[0] * dx
        sy += part[2] + part[0] * dy
        sxx += part[3] + 2 * dx * part[1] + part[0] * dx * dx
        sxy += part[4] + dx * part[2] + dy * part[1] + part[0] * dx * dy
        syy += part[5] + 2 * dy * part[2] + part[0] * dy * dy
        fx += part[6]
        fy += part[7]
    gaussian = grid.gaussians[row]
    if n < minimum:
        gaussian[:] = 0.0
        return
    mx, my = sx / n, sy / n
    xx, xy, yy = sxx / n - mx * mx, sxy / n - mx * my, syy / n - my * my
    # Eigenvalues of the 2 × 2 covariance; both are raised to the floor.
    middle, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    large = max(middle + radius, floor * floor)
    small = max(middle - radius, floor * floor, 0.001 * large)
    if radius > 0.0:
        c2, s2 = 0.5 * (xx - yy) / radius, xy / radius
    else:
        c2, s2 = 1.0, 0.0
    along = small / (large * large)
    mean, half_gap = 0.5 * (along + 1 / small), 0.5 * (along - 1 / small)
    ix, iy = key // (2 * HALF_KEY) - HALF_KEY, key % (2 * HALF_KEY) - HALF_KEY
    gaussian[0] = (ix + 0.5) * half + mx
    gaussian[1] = (iy + 0.5) * half + my
    gaussian[2] = mean + half_gap * c2
    gaussian[3] = half_gap * s2
    gaussian[4] = mean - half_gap * c2
    # The normal is the eigenvector of the smaller eigenvalue, at a right angle to (cos ½β, sin ½β).
    along_angle = 0.5 * np.arctan2(s2, c2)
    nx, ny = -np.sin(along_angle), np.cos(along_angle)
    through = (fx * nx + fy * ny) / n
    gaussian[5] = gaussian[6] = 0.0
    if abs(through) > ONE_SIDED:
        side = -1.0 if through > 0.0 else 1.0
        gaussian[5], gaussian[6] = side * nx, side * ny


class Ndt:
    """A normal distributions transform that grows and shrinks by the points of scans.

    `cell` is the side (m) of a Gaussian's cell, `minimum` the least number of points that make a
    Gaussian, `floor` its least standard deviation (m).
    """

    def __init__(self, cell: float, minimum: int = 3, floor: float = 0.02, capacity: int = 512) -> None:
        self.cell, self.minimum, self.floor = cell, float(minimum), floor
        self.rows = 0
        self.grid = _empty(max(capacity, 16))

    @property
    def half(self) -> float:
        """Side (m) of a lattice cell."""
        return 0.5 * self.cell

    def add(self, points: Array, pose: Array) -> None:
        """Grow by points (m, 2), moved by `pose` (3,)."""
        self._change(points, pose, 1.0)

    def subtract(self, points: Array, pose: Array) -> None:
        """Take away points that were added with the very same pose."""
        self._change(points, pose, -1.0)

    def _change(self, points: Array, pose: Array, sign: float) -> None:
        self._reserve(self.rows + NEW_NEIGHBOURS * len(points))
        self.rows = add_points(self.grid, self.rows, self.half, points, pose, sign, self.minimum, self.floor)

    def _reserve(self, rows: int) -> None:
        capacity = len(self.grid.keys)
        if rows <= capacity:
            return
        old, self.grid = self.grid, _empty(max(rows, 2 * capacity))
        for name in ("keys", "links", "sums", "gaussians"):
            getattr(self.grid, name)[: self.rows] = getattr(old, name)[: self.rows]
        rehash(self.grid, self.rows)

    def compact(self) -> None:
        """Give back the memory that only growing needs; nothing can be added any more."""
        grid, rows = self.grid, self.rows
        usable = grid.gaussians[:rows, 2] != 0.0
        # −1 as an index finds the last entry: no Gaussian.
        places = np.append(np.where(usable, np.cumsum(usable) - 1, -1), -1).astype(np.int32)
        links = places[grid.links[:rows]]
        kept = (links >= 0).any(axis=1)
        self.rows = int(np.count_nonzero(kept))
        table = np.full(_table_size(self.rows), -1, dtype=np.int32)
        self.grid = Grid(
            table, grid.keys[:rows][kept], links[kept], np.empty((0, 8)), grid.gaussians[:rows][usable]
        )
        rehash(self.grid, self.rows)

    def gaussian_count(self) -> int:
        """How many Gaussians have points enough."""
        return int(np.count_nonzero(self.grid.gaussians[:, 2]))


def _empty(capacity: int) -> Grid:
    return Grid(
        table=np.full(_table_size(capacity), -1, dtype=np.int32),
        keys=np.empty(capacity, dtype=np.int64),
        links=np.empty((capacity, 4), dtype=np.int32),
        sums=np.empty((capacity, 8)),
        gaussians=np.zeros((capacity, 7)),
    )


def _table_size(rows: int) -> int:
    return 1 << max(2 * rows - 1, 1).bit_length()
