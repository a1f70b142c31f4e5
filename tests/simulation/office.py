"""The office floor: its walls, what stands in its rooms, and the robot's way."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from nscan_cli.poses import Array
from tests.simulation.world import Builder, World

WIDTH, DEPTH = 40.0, 25.0
DOOR = 0.95
GLASS = 0.6
FURNITURE_SEED = 2006
ROBOT = 0.45
"""m that furniture keeps from the robot's way."""

SOUTH, NORTH, WEST, EAST = 6.5, 18.3, 5.8, 33.2
"""The outer walls of the corridor."""
INNER = (8.0, 8.7, 31.0, 16.2)
"""The block inside the loop: x1, y1, x2, y2."""

ROOMS = (
    (0.0, 0.0, 4.2, SOUTH), (4.2, 0.0, 9.0, SOUTH), (9.0, 0.0, 12.6, SOUTH), (12.6, 0.0, 19.5, SOUTH),
    (19.5, 0.0, 24.0, SOUTH), (24.0, 0.0, 30.1, SOUTH), (30.1, 0.0, WIDTH, SOUTH),
    (0.0, NORTH, 7.4, DEPTH), (7.4, NORTH, 10.3, DEPTH), (10.3, NORTH, 17.2, DEPTH),
    (17.2, NORTH, 21.0, DEPTH), (21.0, NORTH, 27.4, DEPTH), (27.4, NORTH, 31.2, DEPTH),
    (31.2, NORTH, WIDTH, DEPTH),
    (0.0, 8.7, WEST, 13.2), (0.0, 13.2, WEST, NORTH),
    (EAST, SOUTH, WIDTH, 12.0), (EAST, 12.0, WIDTH, NORTH),
    (8.0, 8.7, 14.3, 16.2), (14.3, 8.7, 20.9, 16.2), (20.9, 8.7, 26.2, 16.2), (26.2, 8.7, 31.0, 16.2),
)  # fmt: skip
"""x1, y1, x2, y2."""

DOORS_SOUTH = (3.0, 5.2, 10.7, 15.4, 20.6, 28.9, 31.8)
DOORS_NORTH = (6.6, 8.3, 12.0, 20.1, 22.0, 29.4, 32.3)
DOORS_WEST, DOORS_EAST = (10.5, 16.8), (9.9, 14.4)


def office_world() -> World:
    """The floor with everything that stands on it."""
    floor = Builder()
    _outer_walls(floor)
    _inner_walls(floor)
    _corridor_details(floor)
    rng = np.random.Generator(np.random.PCG64(FURNITURE_SEED))
    way = _dense(office_way())
    for room in ROOMS:
        _furnish(floor, room, way, rng)
    return floor.world()


def _outer_walls(floor: Builder) -> None:
    floor.line(0, 0, WIDTH, 0)
    floor.line(WIDTH, 0, WIDTH, DEPTH)
    floor.line(0, 0, 0, DEPTH)
    # Windows to the north: panes between piers that stand out into the rooms.
    panes = ((1.2, 3.1), (11.5, 14.2), (22.1, 24.6), (33.4, 37.7))
    begin = 0.0
    for left, right in panes:
        floor.line(begin, DEPTH, left, DEPTH)
        floor.line(left, DEPTH, left, DEPTH + 0.2)
        floor.line(left, DEPTH + 0.2, right, DEPTH + 0.2, GLASS)
        floor.line(right, DEPTH + 0.2, right, DEPTH)
        begin = right
    floor.line(begin, DEPTH, WIDTH, DEPTH)


def _inner_walls(floor: Builder) -> None:
    x1, y1, x2, y2 = INNER
    floor.wall((0, SOUTH), (WIDTH, SOUTH), tuple((x, DOOR) for x in DOORS_SOUTH))
    floor.wall((0, NORTH), (WIDTH, NORTH), tuple((x, DOOR) for x in DOORS_NORTH))
    floor.wall((WEST, 8.7), (WEST, NORTH), tuple((y, DOOR) for y in DOORS_WEST))
    floor.wall((EAST, SOUTH), (EAST, NORTH), tuple((y, DOOR) for y in DOORS_EAST))
    floor.wall((0, 8.7), (WEST, 8.7))
    floor.wall((0, 13.2), (WEST, 13.2))
    floor.wall((EAST, 12.0), (WIDTH, 12.0))
    for x in (4.2, 9.0, 12.6, 19.5, 24.0, 30.1):
        floor.wall((x, 0), (x, SOUTH))
    for x in (7.4, 10.3, 17.2, 21.0, 27.4, 31.2):
        floor.wall((x, NORTH), (x, DEPTH))
    # The block inside the loop: a door to the south, a lounge open to it, a glazed meeting room.
    floor.wall((x1, y1), (x2, y1), ((10.2, DOOR), (23.5, 2.6)))
    floor.wall((x1, y2), (14.3, y2))
    floor.wall((14.3, y2), (20.9, y2), ((18.8, DOOR),), thickness=0.06, absorption=GLASS)
    floor.wall((20.9, y2), (x2, y2))
    floor.wall((x1, y1), (x1, y2))
    floor.wall((x2, y1), (x2, y2), ((12.9, DOOR),))
    for x in (14.3, 20.9, 26.2):
        floor.wall((x, y1), (x, y2))


def _corridor_details(floor: Builder) -> None:
    half = 0.075
    # Piers and ducts at irregular distances, a niche's worth deep.
    for x in (7.1, 13.3, 18.2, 25.4, 27.0):
        floor.box(x, SOUTH + half, x + 0.35, SOUTH + half + 0.18)
    for x in (9.5, 15.1, 18.5, 25.0, 30.6):
        floor.box(x, NORTH - half - 0.15, x + 0.4, NORTH - half)
    for y in (12.1, 14.7):
        floor.box(WEST + half, y, WEST + half + 0.2, y + 0.3)
    for y in (7.4, 12.6, 16.5):
        floor.box(EAST - half - 0.15, y, EAST - half, y + 0.45)
    # A row of lockers, a copier, a plant, a water cooler, a bench in the lobby.
    floor.box(15.0, 8.7 - half - 0.45, 18.4, 8.7 - half)
    floor.box(26.9, 8.7 - half - 0.6, 28.1, 8.7 - half)
    floor.box(10.6, 16.2 + half, 12.3, 16.2 + half + 0.4)
    floor.pillar(30.4, 16.7, 0.22)
    floor.pillar(7.7, 12.3, 0.16)
    floor.pillar(24.9, 8.42, 0.16)
    floor.box(1.1, 8.7 - half - 0.42, 2.9, 8.7 - half)
    floor.box(0.0, 6.9, 0.35, 7.3)


def _furnish(
    floor: Builder, room: tuple[float, float, float, float], way: Array, rng: np.random.Generator
) -> None:
    """Cabinets along the walls, desks on legs, chairs, now and then a crate; never in the robot's way."""
    x1, y1, x2, y2 = (side + inset for side, inset in zip(room, (0.1, 0.1, -0.1, -0.1), strict=True))
    area = (x2 - x1) * (y2 - y1)
    doors = np.array(
        [(x, SOUTH) for x in DOORS_SOUTH] + [(x, NORTH) for x in DOORS_NORTH]
        + [(WEST, y) for y in DOORS_WEST] + [(EAST, y) for y in DOORS_EAST]
        + [(10.2, 8.7), (23.5, 8.7), (22.6, 8.7), (24.4, 8.7), (18.8, 16.2), (31.0, 12.9)]
    )  # fmt: skip
    keep_out = np.concatenate([way, doors])
    for _ in range(2 + int(area / 9)):
        wide, deep = rng.uniform(0.6, 1.8), rng.uniform(0.35, 0.6)
        side, share = int(rng.integers(4)), float(rng.random())
        if side % 2:
            wide, deep = deep, wide
        left = (x1 + share * (x2 - x1 - wide), x2 - wide, x1 + share * (x2 - x1 - wide), x1)[side]
        low = (y1, y1 + share * (y2 - y1 - deep), y2 - deep, y1 + share * (y2 - y1 - deep))[side]
        if _free(keep_out, left, low, left + wide, low + deep):
            floor.box(left, low, left + wide, low + deep)
    for _ in range(2 + int(area / 8)):
        x, y, turn = rng.uniform(x1 + 0.8, x2 - 0.8), rng.uniform(y1 + 0.8, y2 - 0.8), rng.uniform(0, np.pi)
        kind, sizes = rng.random(), rng.uniform(0.3, 0.55, 2)
        if not _free(keep_out, x - 0.7, y - 0.7, x + 0.7, y + 0.7):
            continue
        if kind < 0.2:
            floor.box(x - sizes[0], y - sizes[1], x + sizes[0], y + sizes[1], turn)
            continue
        width, depth, leg = (1.3, 0.7, 0.03) if kind < 0.6 else (0.42, 0.42, 0.018)
        for u in (-0.5, 0.5):
            for v in (-0.5, 0.5):
                c, s = np.cos(turn), np.sin(turn)
                floor.pillar(x + c * u * width - s * v * depth, y + s * u * width + c * v * depth, leg)


def _free(points: Array, x1: float, y1: float, x2: float, y2: float) -> bool:
    """Whether a box keeps its distance from all points (P, 2)."""
    dx = np.maximum(np.maximum(x1 - points[:, 0], points[:, 0] - x2), 0)
    dy = np.maximum(np.maximum(y1 - points[:, 1], points[:, 1] - y2), 0)
    return bool((np.hypot(dx, dy) > ROBOT).all())


def _dense(way: Array) -> Array:
    """Points (P, 2) every 10 cm or so along way points (W, 2)."""
    parts = [
        a + np.linspace(0, 1, 2 + int(np.hypot(*(b - a)) / 0.1))[:, None] * (b - a) for a, b in pairwise(way)
    ]
    return np.concatenate(parts)


def office_way() -> Array:
    """The robot's way points (W, 2): from the lobby round the loop with visits to rooms, and round again."""
    south, north, west, east = 7.55, 17.2, 6.9, 32.1
    way: list[tuple[float, float]] = [(1.2, 7.75), (4.0, 7.55)]

    def visit(door: tuple[float, float], inwards: tuple[float, float], *stops: tuple[float, float]) -> None:
        x, y = door
        dx, dy = inwards
        front, inside = (x - 0.9 * dx, y - 0.9 * dy), (x + 0.8 * dx, y + 0.8 * dy)
        way.extend([front, inside, *stops, inside, front])

    def down(x: float, *stops: tuple[float, float]) -> None:
        visit((x, SOUTH), (0, -1), *stops)

    def up(x: float, *stops: tuple[float, float]) -> None:
        visit((x, NORTH), (0, 1), *stops)

    down(5.2, (6.2, 4.4))
    visit((10.2, 8.7), (0, 1), (10.9, 11.6), (12.0, 13.0))
    down(15.4, (16.4, 3.2), (14.4, 3.6))
    visit((23.5, 8.7), (0, 1), (23.1, 12.0))
    down(28.9, (27.2, 3.4))
    way.extend([(31.0, south), (east, 8.4)])
    visit((EAST, 9.9), (1, 0), (36.0, 9.2))
    way.extend([(east, 15.9), (31.2, north)])
    up(29.4, (29.6, 21.7))
    up(22.0, (23.7, 21.5))
    visit((18.8, 16.2), (0, -1), (17.6, 13.0))
    up(12.0, (13.6, 21.9))
    way.extend([(7.9, north)])
    up(6.6, (4.3, 21.2))
    way.extend([(west, 16.4)])
    visit((WEST, 10.5), (-1, 0), (3.0, 11.2))
    way.extend([(west, 8.8), (7.9, south), (20.0, 7.5), (30.9, south), (east, 8.9)])
    visit((31.0, 12.9), (-1, 0), (28.6, 11.8))
    way.extend([(east, 16.0), (31.0, north), (20.0, 17.25), (8.2, north), (west, 15.9), (west, 12.0)])
    return np.array(way)
