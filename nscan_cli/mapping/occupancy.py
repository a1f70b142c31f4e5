"""Poses + scans → how often each cell of the floor was hit by a beam and how often passed through.

A cell's share of hits estimates how likely it reflects a beam (the counting model of S. Thrun, W. Burgard,
D. Fox, "Probabilistic Robotics", 2005, 9.2).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from nscan_cli.errors import WrongUsageError
from nscan_cli.files.limits import MAP_CELLS
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.mapping.ray_casting import TILE, ScanRays, TileCounts, cast_rays, ray_bounds
from nscan_cli.poses import Array

RESOLUTION = 0.05
"""Size of a cell, m."""
REACH = 40.0
"""A beam is followed so far (m): further out, neighbouring beams leave gaps of many cells, and a slip of
the angle carries a wall away."""
COARSEST = 10.0
"""m; a map of larger cells shows nothing."""
OCCUPIED_SHARE = 0.25
"""A cell is occupied when at least this share of the beams that reached it ended in it. Under one half,
since beams that run along a wall graze its cells on their way to the next ones, and a wall on the border
of two cells shares its hits among them; well above the share that somebody leaves who walks by."""
LEAST_HITS = 2
"""A cell that a single beam has hit is not taken for occupied: that is what stray returns look like."""

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""The states of a cell, with the values of ROS's OccupancyGrid message."""

Number = TypeVar("Number", bound=np.integer[Any])


class OccupancyGrid:
    """Counts of a grid of H × W cells; row 0 is the row of least y, column 0 that of least x."""

    def __init__(
        self,
        hits: NDArray[np.int32],
        misses: NDArray[np.int32],
        resolution: float,
        origin: tuple[float, float],
    ) -> None:
        """Take hits and misses (H, W) as the properties have them."""
        self._take(_tiled(hits, misses), hits.shape, resolution, origin)

    @classmethod
    def of_tiles(
        cls, tiles: TileCounts, shape: tuple[int, int], resolution: float, origin: tuple[float, float]
    ) -> OccupancyGrid:
        """The grid of `shape` (H, W) with the counts of its tiles."""
        grid = cls.__new__(cls)
        grid._take(tiles, shape, resolution, origin)
        return grid

    def _take(
        self, tiles: TileCounts, shape: tuple[int, ...], resolution: float, origin: tuple[float, float]
    ) -> None:
        self._tiles = tiles
        self.shape = shape[0], shape[1]
        """H, W"""
        self.resolution = resolution
        """Size of a cell, m."""
        self.origin = origin
        """x, y (m) of the lower left corner of the cell (0, 0)."""

    @property
    def hits(self) -> NDArray[np.int32]:
        """(H, W) how many beams end in the cell."""
        return self._whole(lambda counts: counts[:, 0], 0)

    @property
    def misses(self) -> NDArray[np.int32]:
        """(H, W) how many beams pass through the cell or start in it, and end in another."""
        return self._whole(lambda counts: counts[:, 1], 0)

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """The least x, least y, greatest x and greatest y (m) that the grid covers."""
        (height, width), (x, y) = self.shape, self.origin
        return x, y, x + width * self.resolution, y + height * self.resolution

    def states(self) -> NDArray[np.int8]:
        """(H, W) FREE, OCCUPIED or UNKNOWN.

        A cell that was passed through but not hit often enough to be occupied is free; one that was only
        hit, by a single beam, stays unknown.
        """
        return self._whole(_states, UNKNOWN)

    def _whole(
        self, of_tiles: Callable[[NDArray[np.int32]], NDArray[Number]], elsewhere: int
    ) -> NDArray[Number]:
        """(H, W) what is made of the counts (n, 2, TILE, TILE) of tiles; `elsewhere` where there are none."""
        (height, width), index, counts = self.shape, *self._tiles
        whole = np.full((height, width), elsewhere, dtype=of_tiles(counts[:0]).dtype)
        for row, numbers in enumerate(index):
            columns = np.flatnonzero(numbers >= 0)
            lines = whole[row * TILE : (row + 1) * TILE]
            for column, tile in zip(columns.tolist(), of_tiles(counts[numbers[columns]]), strict=True):
                part = lines[:, column * TILE : (column + 1) * TILE]
                part[:] = tile[: part.shape[0], : part.shape[1]]
        return whole


def _states(counts: NDArray[np.int32]) -> NDArray[np.int8]:
    """(n, TILE, TILE) the states of tiles with the counts (n, 2, TILE, TILE)."""
    hits, misses = counts[:, 0], counts[:, 1]
    states = np.where(misses > 0, np.int8(FREE), np.int8(UNKNOWN))
    states[(hits >= LEAST_HITS) & (hits >= OCCUPIED_SHARE * (hits + misses))] = OCCUPIED
    return states


def _tiled(hits: NDArray[np.int32], misses: NDArray[np.int32]) -> TileCounts:
    """The tiles of counts (H, W), all of them."""
    height, width = hits.shape
    rows, columns = -(-height // TILE), -(-width // TILE)
    padded = np.zeros((2, rows * TILE, columns * TILE), dtype=np.int32)
    padded[:, :height, :width] = hits, misses
    counts = padded.reshape(2, rows, TILE, columns, TILE).transpose(1, 3, 0, 2, 4).reshape(-1, 2, TILE, TILE)
    return TileCounts(
        np.arange(len(counts), dtype=np.int32).reshape(rows, columns), np.ascontiguousarray(counts)
    )


def occupancy_grid(
    log: LaserLog,
    rows: NDArray[np.int64],
    poses: Array,
    resolution: float = RESOLUTION,
    threads: int = 1,
) -> OccupancyGrid:
    """The grid of the scans in `rows` (N,) of the log, taken at the robot's `poses` (N, 3).

    A beam that met nothing clears nothing: it may as well have met black velvet, or glass. A beam longer
    than REACH clears the cells up to there. The grid covers all beams and poses, and its cells lie on
    multiples of the resolution. Raises WrongUsageError when there are no scans, or when the grid would
    have more cells than the limit MAP_CELLS allows.
    """
    if len(rows) == 0:
        raise WrongUsageError(f"{log.source.name}: no scans to draw a map of; choose some")
    lasers = np.ascontiguousarray(log.laser_pose(poses))
    scans = ScanRays(np.asarray(rows, dtype=np.int64), log.ranges, log.angle_min, log.angle_increment, lasers)
    low_x, low_y, high_x, high_y = ray_bounds(scans, REACH)
    # One cell to spare: the border of the map is then free of what is drawn in it, and rounding harmless.
    left, bottom = math.floor(low_x / resolution) - 1, math.floor(low_y / resolution) - 1
    width = math.floor(high_x / resolution) + 2 - left
    height = math.floor(high_y / resolution) + 2 - bottom
    most = MAP_CELLS.value
    if width * height > most:
        enough = _rounded_up(resolution * math.sqrt(width * height / most))
        remedy = "some poses are far off" if enough > COARSEST else f"choose --resolution {enough:g}"
        raise WrongUsageError(
            f"a map of {high_x - low_x:.0f} m × {high_y - low_y:.0f} m would have {width * height:,} cells "
            f"of {resolution:g} m, more than {most:,.0f}; {remedy}, or set {MAP_CELLS.variable} higher"
        )
    shape, corner = (height, width), (left * resolution, bottom * resolution)
    tiles = cast_rays(scans, REACH, shape, resolution, left, bottom, threads)
    return OccupancyGrid.of_tiles(tiles, shape, resolution, corner)


def _rounded_up(value: float) -> float:
    """To two significant digits, never less than `value`."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return round(math.ceil(value / unit) * unit, 12)
