"""A building as large as one likes: corridors that cross, blocks of rooms between, and long ways through.

Made for logs of 100,000 scans and more: rays are followed through a grid that knows the walls in each of
its cells (J. Amanatides, A. Woo, "A fast voxel traversal algorithm for ray tracing", 1987), so that a scan
takes no longer in a large building than in a small one.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.decorators import kernel
from nscan_cli.poses import Array, compose
from tests.simulation.drive import Drive, Odometry, odometry, poses
from tests.simulation.laser import Laser, with_errors
from tests.simulation.recording import Recording
from tests.simulation.world import Builder, World

HALF_WIDTH = 1.1
"""m from the middle of a corridor to its walls."""
DOOR = 0.95
CELL = 1.0
"""m; of the grid that the rays are followed through."""
CHUNK = 8192
"""Scans measured at once."""
SEED = 1

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Building:
    """Where corridors run, and all walls."""

    xs: Array
    """(C + 1,) m, the corridors along y."""
    ys: Array
    """(R + 1,) m, those along x."""
    world: World

    def crossings(self, places: list[tuple[int, int]]) -> Array:
        """Way points (W, 2) at crossings (column, row) of corridors."""
        return np.array([(self.xs[column], self.ys[row]) for column, row in places])


def building(columns: int, rows: int, seed: int = SEED) -> Building:
    """C × R blocks of rooms of 14 to 24 m by 12 to 18 m, no two alike, with corridors all around each."""
    rng = np.random.Generator(np.random.PCG64(seed))
    xs = np.concatenate([[0.0], np.cumsum(np.round(rng.uniform(14.0, 24.0, columns), 1))])
    ys = np.concatenate([[0.0], np.cumsum(np.round(rng.uniform(12.0, 18.0, rows), 1))])
    floor = Builder()
    left, bottom, right, top = (
        xs[0] - HALF_WIDTH, ys[0] - HALF_WIDTH, xs[-1] + HALF_WIDTH, ys[-1] + HALF_WIDTH,
    )  # fmt: skip
    floor.box(left, bottom, right, top)
    for column in range(columns):
        for row in range(rows):
            near, far = (xs[column], ys[row]), (xs[column + 1], ys[row + 1])
            block = tuple(at + HALF_WIDTH for at in near) + tuple(at - HALF_WIDTH for at in far)
            _block(floor, block, rng)
    for x in _spread(left, right, 6.0, rng):
        for y, inwards in ((bottom, 1.0), (top, -1.0)):
            _pier(floor, (x, y), (0.3, 0.2 * inwards), rng)
    for y in _spread(bottom, top, 6.0, rng):
        for x, inwards in ((left, 1.0), (right, -1.0)):
            _pier(floor, (x, y), (0.2 * inwards, 0.3), rng)
    return Building(xs, ys, floor.world())


def _block(floor: Builder, block: tuple[float, ...], rng: np.random.Generator) -> None:
    """Two rows of rooms, back to back, each with a door to a corridor, and what stands in them."""
    x1, y1, x2, y2 = block
    middle = (y1 + y2) / 2 + rng.uniform(-1.5, 1.5)
    floor.wall((x1, middle), (x2, middle))
    side_doors: dict[float, list[tuple[float, float]]] = {x1: [], x2: []}
    for low, high, outer in ((y1, middle, y1), (middle, y2, y2)):
        borders = [x1, *_spread(x1 + 3.0, x2 - 3.0, 5.0, rng), x2]
        doors = []
        for a, b in itertools.pairwise(borders):
            side = {borders[0]: x1, borders[-2]: x2}.get(a)
            if side is not None and rng.random() < 0.4:
                side_doors[side].append((rng.uniform(low + 1.2, high - 1.2), DOOR))
            else:
                doors.append((rng.uniform(a + 0.8, b - 0.8), DOOR))
            _furnish(floor, (a, low, b, high), rng)
        for x in borders[1:-1]:
            floor.wall((x, low), (x, high))
        floor.wall((x1, outer), (x2, outer), tuple(doors))
        outwards = -1.0 if outer == y1 else 1.0
        for x in _spread(x1, x2, 7.0, rng):
            if all(abs(x - door) > 1.0 for door, _ in doors):
                _pier(floor, (x, outer + 0.07 * outwards), (0.3, 0.25 * outwards), rng)
    for x, openings in side_doors.items():
        floor.wall((x, y1), (x, y2), tuple(openings))


def _spread(low: float, high: float, step: float, rng: np.random.Generator) -> list[float]:
    """Places between two others, about `step` apart."""
    places = np.arange(low + step, high - step / 2, step)
    return [float(place) for place in places + rng.uniform(-0.25, 0.25, len(places)) * step]


def _pier(
    floor: Builder, at: tuple[float, float], size: tuple[float, float], rng: np.random.Generator
) -> None:
    """A pier, a duct or a cabinet on a wall."""
    wide, deep = size
    if abs(wide) > abs(deep):
        wide *= rng.uniform(0.7, 3.0)
    else:
        deep *= rng.uniform(0.7, 3.0)
    floor.box(at[0], at[1], at[0] + wide, at[1] + deep)


def _furnish(floor: Builder, room: tuple[float, float, float, float], rng: np.random.Generator) -> None:
    x1, y1, x2, y2 = room
    for _ in range(int(rng.integers(2, 6))):
        x, y = rng.uniform(x1 + 0.8, x2 - 0.8), rng.uniform(y1 + 0.8, y2 - 0.8)
        wide, deep = rng.uniform(0.2, 0.7, 2)
        floor.box(x - wide, y - deep, x + wide, y + deep, rng.uniform(0, np.pi))


def rounds(loops: int) -> Recording:
    """The same way round a floor of six blocks and between them, `loops` times: 246 m each."""
    place = building(3, 2)
    way = [(0, 0), (1, 0), (2, 0), (3, 0), (3, 1), (3, 2), (2, 2), (2, 1), (2, 0), (1, 0), (1, 1), (1, 2)]
    way += [(0, 2), (0, 1)]
    return drive(place, place.crossings(way * loops + way[:1]), "rounds")


def growing(scans: int, columns: int = 14) -> Recording:
    """A way round block after block, row after row, so many scans long."""
    # A ring has some 75 m, and the way on to the next 19 m; a scan is made every 0.11 m.
    rows = 2 + int(scans * 0.11 / 70 / columns)
    place, way = building(columns, rows), [(0, 0)]
    for row in range(rows):
        order = range(columns) if row % 2 == 0 else range(columns, 0, -1)
        step = 1 if row % 2 == 0 else -1
        for column in order:
            on = column + step
            way += [(on, row), (on, row + 1), (column, row + 1), (column, row), (on, row)]
        way.append((way[-1][0], row + 1))
    return first(drive(place, place.crossings(way), "growing", scans), scans)


def first(recording: Recording, scans: int) -> Recording:
    """The beginning of a recording."""
    return replace(
        recording,
        times=recording.times[:scans],
        truth=recording.truth[:scans],
        odometry=recording.odometry[:scans],
        readings=recording.readings[:scans],
    )


def drive(
    place: Building,
    waypoints: Array,
    name: str,
    scans: int | None = None,
    laser: Laser | None = None,
    how: Drive | None = None,
    seed: int = SEED,
) -> Recording:
    """What a robot records on its way through a building; at most the first `scans`."""
    how, laser = how or Drive(), laser or Laser()
    truth = poses(waypoints, how)[:scans]
    rng = np.random.Generator(np.random.PCG64(seed))
    origins = compose(truth, np.array(laser.mount))
    cells = cells_of(place.world)
    readings = np.empty((len(truth), laser.beams))
    for at in range(0, len(truth), CHUNK):
        part = np.ascontiguousarray(origins[at : at + CHUNK])
        ranges, incidence = follow(cells, part, laser.angles(), laser.max_range)
        readings[at : at + CHUNK] = with_errors(ranges, incidence, np.zeros(1), laser, rng)
    times = np.arange(len(truth), dtype=np.float64) * how.period
    return Recording(name, laser, times, truth, odometry(truth, Odometry(), rng), readings)


class Cells(NamedTuple):
    """The segments of a world by the cells of a grid that they may touch."""

    segments: Array
    """(N, 4): x1, y1, x2, y2 in m from the corner of the grid."""
    left: float
    bottom: float
    """m"""
    shape: tuple[int, int]
    """Columns, rows."""
    starts: Indices
    """(columns · rows + 1,) where the segments of each cell begin."""
    members: Indices


def cells_of(world: World) -> Cells:
    """The grid of a world; its pillars are not taken over."""
    ends = world.segments.reshape(-1, 2, 2)
    corner = ends.min(axis=(0, 1)) - CELL
    low, high = (np.floor((pick(ends, axis=1) - corner) / CELL + shift).astype(np.int64)
                 for pick, shift in ((np.min, -1e-9), (np.max, 1e-9)))  # fmt: skip
    columns, rows = (high.max(axis=0) + 2).tolist()
    size = high - low + 1
    each = np.repeat(np.arange(len(ends)), size[:, 0] * size[:, 1])
    within = np.arange(len(each)) - np.searchsorted(each, each)
    cell = (low[each, 1] + within // size[each, 0]) * columns + low[each, 0] + within % size[each, 0]
    order = np.argsort(cell, kind="stable")
    starts = np.searchsorted(cell[order], np.arange(columns * rows + 1))
    segments = np.ascontiguousarray((ends - corner).reshape(-1, 4))
    return Cells(segments, float(corner[0]), float(corner[1]), (columns, rows), starts, each[order])


@kernel
def follow(cells: Cells, origins: Array, angles: Array, farthest: float) -> tuple[Array, Array]:
    """Ranges (S, B) from poses (S, 3) of the laser, inf beyond `farthest`, and angles of incidence (S, B)."""
    ranges = np.full((len(origins), len(angles)), np.inf)
    incidence = np.zeros((len(origins), len(angles)))
    columns, rows = cells.shape
    for s in range(len(origins)):
        x, y = origins[s, 0] - cells.left, origins[s, 1] - cells.bottom
        for b in range(len(angles)):
            dx, dy = np.cos(origins[s, 2] + angles[b]), np.sin(origins[s, 2] + angles[b])
            column, row = int(x / CELL), int(y / CELL)
            step_x, step_y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
            between_x = CELL / abs(dx) if dx != 0 else np.inf
            between_y = CELL / abs(dy) if dy != 0 else np.inf
            next_x = ((column + (dx > 0)) * CELL - x) / dx if dx != 0 else np.inf
            next_y = ((row + (dy > 0)) * CELL - y) / dy if dy != 0 else np.inf
            nearest, across = np.inf, 1.0
            while 0 <= column < columns and 0 <= row < rows:
                cell = row * columns + column
                for k in range(cells.starts[cell], cells.starts[cell + 1]):
                    ax, ay, bx, by = cells.segments[cells.members[k]]
                    ax, ay, ex, ey = ax - x, ay - y, bx - ax, by - ay
                    # The beam o + t d meets the line a + s e where t = (a - o) × e / d × e.
                    cross = dx * ey - dy * ex
                    t, u = (ax * ey - ay * ex) / cross, (ax * dy - ay * dx) / cross
                    if 0 < t < nearest and 0 <= u <= 1:
                        nearest, across = t, abs(cross) / np.hypot(ex, ey)
                leave = min(next_x, next_y)
                if nearest <= leave or leave > farthest:
                    break
                if next_x < next_y:
                    column += step_x
                    next_x += between_x
                else:
                    row += step_y
                    next_y += between_y
            if nearest <= farthest:
                ranges[s, b] = nearest
                incidence[s, b] = np.arccos(min(across, 1.0))
    return ranges, incidence
