"""Places that are harder than an office: bare corridors, like aisles, grounds between buildings.

Each is another one for each seed, and has a way through it that comes back to most of its parts, also from
the other end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.poses import Array, compose
from tests.simulation.building import cells_of, follow
from tests.simulation.drive import Drive, Odometry, odometry, poses
from tests.simulation.laser import Laser, with_errors
from tests.simulation.recording import Recording
from tests.simulation.world import Builder, World

LASER_HEIGHT = 0.4
"""m above the ground."""


@dataclass(frozen=True)
class Place:
    """Walls and a way."""

    name: str
    world: World
    waypoints: Array
    """(W, 2)"""
    pitch: float = 0.0
    """Standard deviation of how far the laser looks down, rad: such beams end on the ground."""


def bare_corridors(seed: int) -> Place:
    """A ring of corridors 2 m wide with one across; walls have the frames of doors alone, 4 cm deep."""
    rng = np.random.Generator(np.random.PCG64(seed))
    plan, half = Builder(), 1.0
    long, wide, across = rng.uniform(22, 30), rng.uniform(12, 16), rng.uniform(9, 13)
    plan.box(-half, -half, long + half, wide + half)
    for left, right in ((half, across - half), (across + half, long - half)):
        plan.box(left, half, right, wide - half)
    for x in np.arange(rng.uniform(3, 6), long - 2, rng.uniform(6.0, 8.0)).tolist():
        for y in (-half, wide + half):
            plan.box(x, y - 0.04, x + 0.95, y + 0.04)
    corners = {
        "a": (0, 0),
        "b": (long, 0),
        "c": (long, wide),
        "d": (0, wide),
        "e": (across, 0),
        "f": (across, wide),
    }
    return Place(
        "corridors", plan.world(), np.array([corners[at] for at in "aebcfdaefcbea"], dtype=np.float64)
    )


def warehouse(seed: int) -> Place:
    """A hall of like aisles between racks, 3.4 m apart, whose posts stand every 2.7 m; some bays are full."""
    rng = np.random.Generator(np.random.PCG64(seed))
    plan, racks, length, pitch, deep = Builder(), 7, 27.0, 3.4, 1.1
    plan.box(-4.0, -4.0, racks * pitch + 4.0, length + 4.0)
    for rack in range(racks):
        x = rack * pitch + pitch - deep
        for y in np.arange(0.0, length + 0.1, 2.7).tolist():
            for side in (x, x + deep - 0.1):
                plan.box(side, y, side + 0.1, y + 0.1)
        for y in np.arange(0.2, length - 2.0, 1.35).tolist():
            if rng.random() < 0.6:
                plan.box(x + 0.1, y, x + deep - 0.1, y + 1.1)
    aisles = [rack * pitch + (pitch - deep) / 2 for rack in range(racks)]
    way: list[tuple[float, float]] = []
    for order in (range(racks), (5, 2, 4, 1, 3, 0)):
        for aisle in order:
            ends = (-2.0, length + 2.0)
            if way and way[-1][1] > 0:
                ends = ends[::-1]
            way += [(aisles[aisle], ends[0]), (aisles[aisle], ends[1])]
    return Place("warehouse", plan.world(), np.array(way))


def grounds(seed: int) -> Place:
    """Four buildings with trees, a hedge, parked cars and poles between, and ways driven both ways."""
    rng = np.random.Generator(np.random.PCG64(seed))
    plan, gap = Builder(), rng.uniform(24, 40)
    xs, ys = [0.0, 30 + gap], [0.0, 22 + gap]
    for x in xs:
        for y in ys:
            left, low = x + rng.uniform(0, 6), y + rng.uniform(0, 5)
            right, high = x + rng.uniform(22, 30), y + rng.uniform(15, 22)
            plan.box(left, low, right, high)
            for at in np.arange(left + 3, right - 3, 7.5).tolist():
                plan.box(at, low - rng.uniform(0.2, 1.5), at + rng.uniform(1, 3), low)
    outer = 15.0
    right, top = xs[1] + 30 + outer, ys[1] + 22 + outer
    lane_x, lane_y = 30 + gap / 2, 22 + gap / 2
    for _ in range(160):
        x, y = rng.uniform(-outer - 8, right + 8), rng.uniform(-outer - 8, top + 8)
        lanes = (
            min(abs(x - lane) for lane in (-outer + 6, lane_x, right - 6)),
            min(abs(y - lane) for lane in (-outer + 6, lane_y, top - 6)),
        )
        if min(lanes) > 2.0:
            size = rng.choice([0.06, 0.15, 0.25])
            plan.box(x - size, y - size, x + size, y + size, rng.uniform(0, np.pi))
    for lane in (lane_x, -outer + 6):
        for y in np.arange(ys[0], ys[1] + 10, 2.8).tolist():
            if abs(y + 0.9 - lane_y) > 4.0 and rng.random() < 0.5:
                plan.box(lane + 4.0, y, lane + 8.2, y + 1.8, rng.normal(0, 0.03))
    for x in np.arange(xs[0], right - 12, 1.5).tolist():
        if abs(x + 0.6 - lane_x) > 3.0:
            # A hedge is not straight.
            bends = lane_y + 6 + rng.normal(0, 0.2, 2)
            plan.line(x, float(bends[0]), x + 1.2, float(bends[1]))
    west, east, south, north = -outer + 6, right - 6, -outer + 6, top - 6
    columns, rows = (west, lane_x, east), (south, lane_y, north)
    at = {name: (columns[k % 3], rows[k // 3]) for k, name in enumerate("abcdefghi")}
    return Place(
        "grounds", plan.world(), np.array([at[each] for each in "abefihgdebcfedabehgda"]), np.radians(1.2)
    )


def drive_through(
    place: Place, laser: Laser, how: Drive, errors: Odometry, seed: int, path: Array | None = None
) -> Recording:
    """What a robot records on its way, or along another `path` (S, 3)."""
    rng = np.random.Generator(np.random.PCG64(seed))
    truth = poses(place.waypoints, how) if path is None else path
    origins = np.ascontiguousarray(compose(truth, np.array(laser.mount)))
    ranges, incidence = follow(cells_of(place.world), origins, laser.angles(), laser.max_range)
    if place.pitch:
        # Springs even it out over some scans.
        down, aside = (
            np.convolve(rng.standard_normal(len(truth)), np.full(5, 0.45), "same") for _ in range(2)
        )
        falls = np.outer(down, np.cos(laser.angles())) + np.outer(aside, np.sin(laser.angles()))
        falls *= place.pitch
        ground = np.where(falls > 0.0, LASER_HEIGHT / np.maximum(np.tan(falls), 1e-9), np.inf)
        ground[ground > laser.max_range] = np.inf
        ranges = np.minimum(ranges, ground)
    readings = with_errors(ranges, incidence, np.zeros(1), laser, rng)
    times = np.arange(len(truth), dtype=np.float64) * how.period
    return Recording(place.name, laser, times, truth, odometry(truth, errors, rng), readings)
