"""How a robot drives through way points, and what its odometry makes of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.poses import Array, compose, relative, wrap


@dataclass(frozen=True)
class Drive:
    """The limits of a robot that turns on the spot."""

    speed: float = 0.55
    """m/s"""
    turn_rate: float = 1.0
    """rad/s"""
    period: float = 0.2
    """s between scans."""
    reach: float = 0.25
    """m from a way point at which the robot heads for the next."""


def poses(waypoints: Array, drive: Drive) -> Array:
    """(S, 3) poses at equal steps of time along way points (W, 2), heading for the second at the start.

    The robot steers towards the next way point and slows down as far as it looks elsewhere.
    """
    first = waypoints[1] - waypoints[0]
    x, y, heading = waypoints[0][0], waypoints[0][1], float(np.arctan2(first[1], first[0]))
    path = [(x, y, heading)]
    for goal in waypoints[1:]:
        while np.hypot(goal[0] - x, goal[1] - y) > drive.reach:
            off = float(wrap(np.arctan2(goal[1] - y, goal[0] - x) - heading))
            turn = float(np.clip(2 * off, -drive.turn_rate, drive.turn_rate)) * drive.period
            step = drive.speed * drive.period * max(0.0, np.cos(off)) ** 3
            # The chord of the arc that is driven in one period.
            x += step * np.cos(heading + turn / 2)
            y += step * np.sin(heading + turn / 2)
            heading = float(wrap(heading + turn))
            path.append((x, y, heading))
    return np.array(path)


@dataclass(frozen=True)
class Odometry:
    """The errors of wheel odometry: noise that grows with the way, and a bias that stays."""

    distance_noise: float = 0.01
    """m per √m driven."""
    turn_noise_driving: float = np.radians(0.25)
    """rad per √m driven."""
    turn_noise_turning: float = np.radians(0.5)
    """rad per √rad turned."""
    scale: float = 1.01
    """Of distances: the wheels are not as large as was thought."""
    veer: float = np.radians(0.05)
    """rad per m: one wheel is larger than the other."""


def odometry(truth: Array, errors: Odometry, rng: np.random.Generator) -> Array:
    """(S, 3) poses that wheel odometry gives for true poses (S, 3), from (0, 0, 0) on."""
    steps = relative(truth[1:], truth[:-1])
    distance, turned = np.hypot(steps[:, 0], steps[:, 1]), np.abs(steps[:, 2])
    noise = rng.standard_normal((len(steps), 3))
    steps[:, :2] *= (
        errors.scale + errors.distance_noise * noise[:, 0] / np.sqrt(np.maximum(distance, 1e-3))
    )[:, None]
    steps[:, 2] += (
        errors.veer * distance
        + errors.turn_noise_driving * np.sqrt(distance) * noise[:, 1]
        + errors.turn_noise_turning * np.sqrt(turned) * noise[:, 2]
    )
    found = np.zeros_like(truth)
    for row, step in enumerate(steps):
        found[row + 1] = compose(found[row], step)
    return found
