"""The occupancy grid of scans at known poses: hits and misses of each cell.

The share of hits estimates how likely a cell reflects a beam (the counting model of S. Thrun, W. Burgard,
D. Fox, "Probabilistic Robotics", 2005, 9.2).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from nscan_cli.errors import WrongUsageError
from nscan_cli.files.limits import MAP_CELLS
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.mapping.ray_casting import TILE, ScanRays, SweptRays, TileCounts, cast_rays, ray_bounds
from nscan_cli.poses import Array, Indices


@dataclass(frozen=True)
class OccupancyOptions:
    """Decide how far beams are traced and which cells are occupied."""

    max_beam_length: float = 40.0
    """Length up to which a beam is traced, m. A larger value shows more, with gaps between long beams, whose
    ends an error of the heading displaces more."""
    min_occupied_ratio: float = 0.25
    """Least share of hits among the beams of an occupied cell. It is below one half, because beams along a
    wall graze its cells, and a wall between two cells divides its hits. A person who walks by leaves less. A
    larger share makes fewer cells occupied."""
    min_hits: int = 2
    """Least number of hits of an occupied cell. With 1, a single stray return makes a cell occupied. A larger
    number makes fewer cells occupied."""


DEFAULT_CELL_SIZE = 0.05
"""m"""
MAX_SUGGESTED_CELL_SIZE = 10.0
"""m; a message suggests no larger cells, because such a map shows nothing."""

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""The states of a cell, as in ROS's OccupancyGrid message."""

Number = TypeVar("Number", bound=np.integer[Any])


class OccupancyGrid:
    """Hits and misses of H × W cells; row 0 has the least y, column 0 the least x."""

    def __init__(
        self,
        tiles: TileCounts,
        shape: tuple[int, int],
        resolution: float,
        origin: tuple[float, float],
        options: OccupancyOptions = OccupancyOptions(),
    ) -> None:
        self._tiles = tiles
        self.shape = shape
        """H, W"""
        self.resolution = resolution
        """Size of a cell, m."""
        self.origin = origin
        """x, y (m) of the lower left corner of the cell (0, 0)."""
        self.options = options

    @property
    def hits(self) -> NDArray[np.int32]:
        """(H, W) the number of beams that end in the cell."""
        return self._whole(lambda counts: counts[:, 0], 0)

    @property
    def misses(self) -> NDArray[np.int32]:
        """(H, W) the number of beams that pass through the cell or start in it, and end in another."""
        return self._whole(lambda counts: counts[:, 1], 0)

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """The least x, least y, greatest x and greatest y of the grid, m."""
        (height, width), (x, y) = self.shape, self.origin
        return x, y, x + width * self.resolution, y + height * self.resolution

    def cells_of(self, points: Array) -> tuple[Indices, Indices]:
        """The rows and the columns (n,) of the cells in which points (n, 2), m, lie, also beyond the grid."""
        columns, rows = np.floor((points - np.array(self.origin)) / self.resolution).astype(np.int64).T
        return rows, columns

    def states(self) -> NDArray[np.int8]:
        """(H, W) FREE, OCCUPIED or UNKNOWN.

        A cell with misses that is not occupied is free. A cell with too few hits and no misses is unknown.
        """

        def classify(counts: NDArray[np.int32]) -> NDArray[np.int8]:
            hits, misses = counts[:, 0], counts[:, 1]
            states = np.where(misses > 0, np.int8(FREE), np.int8(UNKNOWN))
            enough = hits >= self.options.min_occupied_ratio * (hits + misses)
            states[(hits >= self.options.min_hits) & enough] = OCCUPIED
            return states

        return self._whole(classify, UNKNOWN)

    def _whole(
        self, of_tiles: Callable[[NDArray[np.int32]], NDArray[Number]], elsewhere: int
    ) -> NDArray[Number]:
        """(H, W) `of_tiles` of the counts (n, 2, TILE, TILE); `elsewhere` in cells without counts."""
        (height, width), index, counts = self.shape, *self._tiles
        whole = np.full((height, width), elsewhere, dtype=of_tiles(counts[:0]).dtype)
        for row, numbers in enumerate(index):
            columns = np.flatnonzero(numbers >= 0)
            lines = whole[row * TILE : (row + 1) * TILE]
            for column, tile in zip(columns.tolist(), of_tiles(counts[numbers[columns]]), strict=True):
                part = lines[:, column * TILE : (column + 1) * TILE]
                part[:] = tile[: part.shape[0], : part.shape[1]]
        return whole


def occupancy_grid(
    log: LaserLog,
    rows: Indices,
    poses: Array,
    resolution: float = DEFAULT_CELL_SIZE,
    threads: int = 1,
    options: OccupancyOptions = OccupancyOptions(),
) -> OccupancyGrid:
    """The grid of the scans in `rows` (N,) of the log at the robot's `poses` (N, 3).

    A beam without return clears nothing, because dark or transparent objects return nothing either. A beam
    longer than `max_beam_length` clears the cells up to that length. The grid covers all beams and poses;
    its corners are multiples of the resolution. Raises WrongUsageError when there are no scans, or when the
    grid would have more than MAP_CELLS cells.
    """
    if len(rows) == 0:
        raise WrongUsageError(f"{log.source.name}: no scans for a map; choose some")
    lasers = np.ascontiguousarray(log.laser_pose(poses))
    swept = SweptRays.of(log.moving_along(poses, rows))
    rows = np.asarray(rows, dtype=np.int64)
    scans = ScanRays(rows, log.ranges, log.angle_min, log.angle_increment, lasers, swept)
    low_x, low_y, high_x, high_y = ray_bounds(scans, options.max_beam_length)
    # One more cell on each side: no beam reaches the border of the map, and rounding is harmless.
    left, bottom = math.floor(low_x / resolution) - 1, math.floor(low_y / resolution) - 1
    width = math.floor(high_x / resolution) + 2 - left
    height = math.floor(high_y / resolution) + 2 - bottom
    limit = MAP_CELLS.value
    if width * height > limit:
        enough = _rounded_up(resolution * math.sqrt(width * height / limit))
        remedy = (
            "some poses are far off"
            if enough > MAX_SUGGESTED_CELL_SIZE
            else f"choose --resolution {enough:g}"
        )
        raise WrongUsageError(
            f"a map of {high_x - low_x:.0f} m × {high_y - low_y:.0f} m would have {width * height:,} cells "
            f"of {resolution:g} m, more than {limit:,.0f}; {remedy}, or set {MAP_CELLS.variable} higher"
        )
    shape, corner = (height, width), (left * resolution, bottom * resolution)
    tiles = cast_rays(scans, options.max_beam_length, shape, resolution, left, bottom, threads)
    return OccupancyGrid(tiles, shape, resolution, corner, options)


def grid_of_counts(
    hits: NDArray[np.int32],
    misses: NDArray[np.int32],
    resolution: float,
    origin: tuple[float, float],
    options: OccupancyOptions = OccupancyOptions(),
) -> OccupancyGrid:
    """The grid with these hits and misses (H, W), the least y first."""
    height, width = hits.shape
    rows, columns = -(-height // TILE), -(-width // TILE)
    padded = np.zeros((2, rows * TILE, columns * TILE), dtype=np.int32)
    padded[:, :height, :width] = hits, misses
    counts = padded.reshape(2, rows, TILE, columns, TILE).transpose(1, 3, 0, 2, 4).reshape(-1, 2, TILE, TILE)
    used = counts.any(axis=(1, 2, 3))
    numbers = np.where(used, np.cumsum(used) - 1, -1).astype(np.int32).reshape(rows, columns)
    tiles = TileCounts(numbers, np.ascontiguousarray(counts[used]))
    return OccupancyGrid(tiles, (height, width), resolution, origin, options)


def _rounded_up(value: float) -> float:
    """`value` rounded up to two significant digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return round(math.ceil(value / unit) * unit, 12)
