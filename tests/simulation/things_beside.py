"""What a laser sees besides the place: people, parts of the robot, and what goes along with it.

Every function takes a log and gives another, as in faults.py.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, compose, relative, transform, wrap
from tests.logs.excerpts import truth_of
from tests.simulation.faults import mounted_otherwise


def people(log: LaserLog, walkers: Array, speed: float = 1.2, radius: float = 0.25) -> LaserLog:
    """People walk to and fro: discs, each between two points of the floor plan, walkers (W, 4)."""
    ranges, truth = log.ranges.copy(), truth_of(log)
    start, leg = walkers[:, :2], walkers[:, 2:] - walkers[:, :2]
    length = np.hypot(leg[:, 0], leg[:, 1])
    for row, time in enumerate(log.times - log.times[0]):
        gone = np.mod(speed * time / length, 2.0)
        places = start + np.where(gone < 1, gone, 2 - gone)[:, None] * leg
        seen = transform(relative(np.zeros(3), log.laser_pose(truth[row])), places)
        beams = log.angle_min[row] + log.angle_increment[row] * np.arange(ranges.shape[1])
        for x, y in seen.tolist():
            off = wrap(beams - np.arctan2(y, x))
            away = np.hypot(x, y)
            across = away * np.sin(off)
            hit = (np.abs(across) < radius) & (np.abs(off) < np.pi / 2) & (away > radius)
            near = away * np.cos(off) - np.sqrt(np.maximum(radius**2 - across**2, 0.0))
            ranges[row, hit] = np.fmin(ranges[row, hit], near[hit])
    return replace(log, ranges=ranges)


def own_parts(
    log: LaserLog, sectors: list[tuple[float, float, float]], noise: float = 0.01, seed: int = 1
) -> LaserLog:
    """Posts of the robot hide what is behind them: each from one bearing of the laser to another (rad), at
    a distance (m), measured with so much noise (m)."""
    ranges, rng = log.ranges.copy(), np.random.default_rng(seed)
    beams = log.angle_min[:, None] + log.angle_increment[:, None] * np.arange(ranges.shape[1])
    for first, last, distance in sectors:
        hidden = (beams >= first) & (beams <= last)
        ranges[hidden] = np.round(distance + noise * rng.standard_normal(int(hidden.sum())), 2)
    return replace(log, ranges=ranges)


def follower(log: LaserLog, distance: float, width: float = 0.5, seed: int = 1) -> LaserLog:
    """Somebody walks behind the robot: a disc that sways by 0.1 m and 0.1 rad."""
    ranges, rng = log.ranges.copy(), np.random.default_rng(seed)
    sway = np.zeros(2)
    for row in range(len(log)):
        sway = 0.95 * sway + np.array([0.1, 0.1]) * np.sqrt(1 - 0.95**2) * rng.standard_normal(2)
        beams = log.angle_min[row] + log.angle_increment[row] * np.arange(ranges.shape[1])
        off = wrap(beams - (np.pi + sway[1] - log.mount[2]))
        away = distance + width / 2 + sway[0]
        across = away * np.sin(off)
        hit = (np.abs(across) < width / 2) & (np.abs(off) < np.pi / 2)
        near = away * np.cos(off) - np.sqrt(np.maximum((width / 2) ** 2 - across**2, 0.0))
        ranges[row, hit] = np.fmin(ranges[row, hit], near[hit])
    return replace(log, ranges=ranges)


def leader(log: LaserLog, distance: float) -> LaserLog:
    """Somebody walks before the robot: a follower of one that looks back."""
    return replace(follower(mounted_otherwise(log, np.pi), distance), mount=log.mount)


def cart(log: LaserLog, hitch: float = 0.35, length: float = 0.5, width: float = 0.5) -> LaserLog:
    """The robot pulls a cart: a box on a bar of 0.15 m whose hinge is `hitch` (m) behind the robot's middle.

    The box is `length` m long and `width` m wide; it turns into the way of the hinge, on wheels at its end.
    """
    ranges, truth = log.ranges.copy(), truth_of(log)
    hinges = compose(truth, np.array([-hitch, 0.0, 0.0]))
    heading, bar = float(truth[0, 2]), 0.15
    corners = np.array([(-bar, -0.5), (-bar, 0.5), (-bar - length, 0.5), (-bar - length, -0.5)]) * (
        1.0,
        width,
    )
    for row in range(len(log)):
        if row:
            step = hinges[row, :2] - hinges[row - 1, :2]
            across = float(step[1] * np.cos(heading) - step[0] * np.sin(heading))
            heading += across / (bar + length)
        box = transform(np.array([*hinges[row, :2], heading]), corners)
        laser = log.laser_pose(truth[row])
        seen = transform(relative(np.zeros(3), laser), box)
        beams = log.angle_min[row] + log.angle_increment[row] * np.arange(ranges.shape[1])
        ranges[row] = np.fmin(ranges[row], _to_outline(beams, seen))
    return replace(log, ranges=ranges)


def _to_outline(beams: Array, corners: Array) -> Array:
    """(B,) distance (m) along bearings (B,) to a polygon (n, 2); inf where it is not met."""
    directions = np.stack([np.cos(beams), np.sin(beams)], axis=-1)
    nearest = np.full(len(beams), np.inf)
    for begin, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        side = end - begin
        turn = directions[:, 0] * side[1] - directions[:, 1] * side[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            away = (begin[0] * side[1] - begin[1] * side[0]) / turn
            along = (begin[0] * directions[:, 1] - begin[1] * directions[:, 0]) / turn
        met = (away > 0.0) & (along >= 0.0) & (along <= 1.0)
        nearest = np.where(met & (away < nearest), away, nearest)
    return nearest
