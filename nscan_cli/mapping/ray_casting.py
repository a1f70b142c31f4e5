"""Ray casting: counts the beams that pass through and end in each cell of a grid.

J. Amanatides, A. Woo, "A fast voxel traversal algorithm for ray tracing", 1987.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel, leaf_kernel, llvm_inline_kernel
from nscan_cli.logs.beam_times import BeamTimes
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.robot_path import RobotPath, interval_at, seen_from
from nscan_cli.poses import Array, Indices
from nscan_cli.threads import map_in_threads

TILE = 32
"""Cells along the side of a tile."""
MAX_THREADS = 4
"""Largest number of threads; each thread has counts of its own."""
NO_CROSSING = 1 << 62
"""t_max of a ray that crosses no border between columns, or none between rows."""


class TileCounts(NamedTuple):
    """The counts of those tiles of a grid that beams have met; beams meet few tiles of a large map."""

    numbers: NDArray[np.int32]
    """(⌈H / TILE⌉, ⌈W / TILE⌉) the number of each tile; −1 if no beam has met it."""
    counts: NDArray[np.int32]
    """(T, 2, TILE, TILE) hits and misses of each numbered tile; further rows are 0."""


class SweptRays(NamedTuple):
    """The beams of a laser that turns: each begins where the laser was when it was measured."""

    path: RobotPath
    """That of the robot; without poses if all beams of a scan begin at one place."""
    stamps: Array
    """(S,) s"""
    beams: BeamTimes
    """Of the S scans."""
    mount: Array
    """(4,) pose of the laser on the robot: x, y, cosine and sine."""

    @classmethod
    def of(cls, log: LaserLog) -> SweptRays:
        """Those of a log that moves along its path; of one without, each scan is seen at once."""
        if log.beam_times is None or log.path is None:
            return cls.at_once()
        x, y, angle = log.mount
        return cls(log.path, log.times, log.beam_times, np.array([x, y, np.cos(angle), np.sin(angle)]))

    @classmethod
    def at_once(cls) -> SweptRays:
        """Those of a laser that sees all beams of a scan at once."""
        none, poses = np.zeros(0), np.zeros((0, 3))
        return cls(RobotPath(none, poses, poses, np.empty((0, 2))), none, BeamTimes(none, none), np.zeros(4))


class ScanRays(NamedTuple):
    """The scans of a log whose beams are traced, and the poses of the laser."""

    rows: Indices
    """(N,) rows of the log."""
    ranges: NDArray[np.float32]
    """(S, B) m"""
    angle_min: Array
    """(S,) rad"""
    angle_increment: Array
    """(S,) rad"""
    lasers: Array
    """(N, 3)"""
    swept: SweptRays
    """Where the laser was at each beam, if it turns."""


def cast_rays(
    scans: ScanRays,
    max_length: float,
    shape: tuple[int, int],
    resolution: float,
    left: int,
    bottom: int,
    threads: int,
) -> TileCounts:
    """The counts of a grid of `shape` (H, W) for the beams of all scans up to `max_length` (m).

    The lower left corner of the grid is at (left, bottom) · resolution. No beam may leave the grid.
    """

    def cast(some: Indices) -> TileCounts:
        index = np.full((-(-shape[0] // TILE), -(-shape[1] // TILE)), -1, dtype=np.int32)
        # The array has room for all tiles, but only the rows that are written take memory.
        tiles = TileCounts(index, np.zeros((index.size, 2, TILE, TILE), dtype=np.int32))
        part = scans._replace(rows=scans.rows[some], lasers=scans.lasers[some])
        _cast_scans(part, max_length, resolution, left, bottom, tiles)
        return tiles

    parts = min(threads, MAX_THREADS)
    whole, *others = map_in_threads(parts, cast, np.array_split(np.arange(len(scans.rows)), parts))
    for tiles in others:
        _add_counts(tiles, whole)
    return whole


@kernel
def ray_bounds(scans: ScanRays, max_length: float) -> tuple[float, float, float, float]:
    """The least x and y and the greatest x and y of the laser poses and the ends of the beams."""
    rows, ranges, angle_min, angle_increment, lasers, swept = scans
    is_swept, at, j = len(swept.stamps) > 0, np.empty(4), 0
    low_x = high_x = lasers[0, 0]
    low_y = high_y = lasers[0, 1]
    for k in range(len(rows)):
        row = rows[k]
        x, y, heading = lasers[k]
        low_x, high_x = min(low_x, x), max(high_x, x)
        low_y, high_y = min(low_y, y), max(high_y, y)
        for beam in range(ranges.shape[1]):
            if not np.isfinite(ranges[row, beam]):
                continue
            r = min(float(ranges[row, beam]), max_length)
            if is_swept:
                j = _place_laser(swept, row, beam, j, at)
                x, y = at[0], at[1]
                low_x, high_x = min(low_x, x), max(high_x, x)
                low_y, high_y = min(low_y, y), max(high_y, y)
            # Most beams end inside the bounds whatever their direction is.
            if x - r > low_x and x + r < high_x and y - r > low_y and y + r < high_y:
                continue
            angle = heading + angle_min[row] + beam * angle_increment[row]
            if is_swept:
                angle += np.arctan2(at[3], at[2]) - heading
            end_x, end_y = x + r * np.cos(angle), y + r * np.sin(angle)
            low_x, high_x = min(low_x, end_x), max(high_x, end_x)
            low_y, high_y = min(low_y, end_y), max(high_y, end_y)
    return low_x, low_y, high_x, high_y


@kernel
def _cast_scans(
    scans: ScanRays, max_length: float, resolution: float, left: int, bottom: int, tiles: TileCounts
) -> None:
    """Adds the beams of all scans to the counts of the tiles."""
    rows, ranges, angle_min, angle_increment, lasers, swept = scans
    is_swept, at, j = len(swept.stamps) > 0, np.empty(4), 0
    counts = tiles.counts.reshape(-1)
    used = 0
    for k in range(len(rows)):
        row = rows[k]
        x = lasers[k, 0] / resolution - left
        y = lasers[k, 1] / resolution - bottom
        for beam in range(ranges.shape[1]):
            r = float(ranges[row, beam])
            if not np.isfinite(r):
                continue
            angle = lasers[k, 2] + angle_min[row] + beam * angle_increment[row]
            if is_swept:
                j = _place_laser(swept, row, beam, j, at)
                x, y = at[0] / resolution - left, at[1] / resolution - bottom
                angle = np.arctan2(at[3], at[2]) + angle_min[row] + beam * angle_increment[row]
            length = min(r, max_length) / resolution
            end_x, end_y = x + length * np.cos(angle), y + length * np.sin(angle)
            used = _traverse(x, y, end_x, end_y, tiles.numbers, counts, used)
            if r <= max_length:
                hit, used = _hit_index(tiles.numbers, int(end_y), int(end_x), used)
                counts[np.uint64(hit)] += 1


@llvm_inline_kernel
def _place_laser(swept: SweptRays, row: int, beam: int, j: int, at: Array) -> int:
    """Write the laser's pose at a beam to at (4,): x, y, cosine and sine of its heading.

    Returns the place of that time in the path, looked for from place j on.
    """
    time = swept.stamps[row] + swept.beams.first[row] + beam * swept.beams.step[row]
    j = interval_at(swept.path.times, time, j)
    at[0], at[1], at[2], at[3] = 0.0, 0.0, 1.0, 0.0
    seen_from(swept.path, at, time, j, at)
    cos, sin, mount = at[2], at[3], swept.mount
    at[0] += cos * mount[0] - sin * mount[1]
    at[1] += sin * mount[0] + cos * mount[1]
    at[2], at[3] = cos * mount[2] - sin * mount[3], sin * mount[2] + cos * mount[3]
    return j


@kernel
def _add_counts(tiles: TileCounts, whole: TileCounts) -> None:
    """Adds the counts of `tiles` to `whole`, which belongs to the same grid."""
    counts, sums = tiles.counts.reshape(-1, 2 * TILE * TILE), whole.counts.reshape(-1, 2 * TILE * TILE)
    used = np.count_nonzero(whole.numbers >= 0)
    for row in range(tiles.numbers.shape[0]):
        for column in range(tiles.numbers.shape[1]):
            number = tiles.numbers[row, column]
            if number < 0:
                continue
            if whole.numbers[row, column] < 0:
                whole.numbers[row, column] = used
                used += 1
            for k in range(2 * TILE * TILE):
                sums[whole.numbers[row, column], k] += counts[number, k]


@leaf_kernel
def _hit_index(numbers: NDArray[np.int32], line: int, column: int, used: int) -> tuple[int, int]:
    """The index of a cell's hits, and the number of numbered tiles; numbers the cell's tile if need be."""
    row, place = np.uint64(line // TILE), np.uint64(column // TILE)
    if numbers[row, place] < 0:
        numbers[row, place] = used
        used += 1
    return int(numbers[row, place]) * 2 * TILE * TILE + line % TILE * TILE + column % TILE, used


@leaf_kernel
def _traverse(
    x: float,
    y: float,
    end_x: float,
    end_y: float,
    numbers: NDArray[np.int32],
    counts: NDArray[np.int32],
    used: int,
) -> int:
    """Counts a miss in each cell from (x, y) up to the cell before that of the end; lengths in cells.

    Returns the number of numbered tiles. A ray through a corner takes the step in y first.
    """
    column, line = int(x), int(y)
    dx, dy = end_x - x, end_y - y
    steps_x, steps_y = abs(int(end_x) - column), abs(int(end_y) - line)
    step_x, step_y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    # t runs from 0 to 1 along the ray. It is t_max at the next border, and t_delta from border to border.
    t_delta_x, t_delta_y = _fixed_point(1 / abs(dx)), _fixed_point(1 / abs(dy))
    t_max_x = (
        _fixed_point((column + 1 - x if dx > 0 else x - column) / abs(dx)) if steps_x > 0 else NO_CROSSING
    )
    t_max_y = _fixed_point((line + 1 - y if dy > 0 else y - line) / abs(dy)) if steps_y > 0 else NO_CROSSING
    left = steps_x + steps_y
    while left > 0:
        at, used = _hit_index(numbers, line, column, used)
        at += TILE * TILE
        # The number of steps along one axis to leave the tile, and of steps along the other axis before.
        steps_x = TILE - column % TILE if dx > 0 else column % TILE + 1
        steps_y = TILE - line % TILE if dy > 0 else line % TILE + 1
        t_out_x, t_out_y = t_max_x + (steps_x - 1) * t_delta_x, t_max_y + (steps_y - 1) * t_delta_y
        if t_out_x < t_out_y:
            steps_y = (t_out_x - t_max_y) // t_delta_y + 1 if t_max_y <= t_out_x else 0
        else:
            steps_x = (t_out_y - t_max_x - 1) // t_delta_x + 1 if t_max_x < t_out_y else 0
        for _ in range(min(steps_x + steps_y, left)):
            counts[np.uint64(at)] += 1
            # All bits are set if the step in x comes first. A comparison would become a branch, which the
            # processor cannot predict, and take twice the time.
            sideways = int(np.int64(np.uint64(t_max_x) - np.uint64(t_max_y))) >> 63
            at += (step_x & sideways) + (TILE * step_y & ~sideways)
            t_max_x += t_delta_x & sideways
            t_max_y += t_delta_y & ~sideways
        left -= steps_x + steps_y
        column += steps_x * step_x
        line += steps_y * step_y
    return used


@leaf_kernel
def _fixed_point(t: float) -> int:
    """t in units of 2⁻⁵²; values above 16 become 16."""
    return int(min(t, 16.0) * 4503599627370496.0)
