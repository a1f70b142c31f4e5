"""What a laser reads in a room of straight walls, for tests of what a log says about its readings."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.logs.lines import flaser
from tests.logs.recordings.messages import PERIOD, START, Odom, Scan, Written

Readings = NDArray[np.float32]
WIDTH, DEPTH = 14.0, 6.0
"""m"""
FIRST, STEP = -math.pi, math.pi / 90
BEAMS, SCANS = 180, 40


def way(scans: int = SCANS) -> NDArray[np.float64]:
    """(S, 3) poses along the room, and turning."""
    along = np.linspace(0.0, 1.0, scans)
    return np.stack([2.0 + 6.0 * along, 2.0 + along, 0.8 * along], axis=1)


def readings(scans: int = SCANS, beams: int = BEAMS, first: float = FIRST, step: float = STEP) -> Readings:
    """(S, B) m along the way, with 5 mm of noise."""
    return readings_at(way(scans), beams, first, step)


def readings_at(
    poses: NDArray[np.float64], beams: int = BEAMS, first: float = FIRST, step: float = STEP
) -> Readings:
    """(S, B) m at poses (S, 3), with 5 mm of noise."""
    x, y, heading = poses.T[:, :, None]
    angles = heading + first + step * np.arange(beams)
    with np.errstate(divide="ignore"):
        to_x = np.where(np.cos(angles) > 0, WIDTH - x, x) / np.abs(np.cos(angles))
        to_y = np.where(np.sin(angles) > 0, DEPTH - y, y) / np.abs(np.sin(angles))
    noise = 0.005 * np.random.default_rng(7).standard_normal(angles.shape)
    found: Readings = (np.minimum(to_x, to_y) + noise).astype(np.float32)
    return found


def recording(ranges: Any, **changes: Any) -> list[Written]:
    """Scans (S, B) as messages, from 0.05 m to 12 m unless said, with the odometry of the way."""
    fields = {"angle_min": FIRST, "step": STEP, "range_min": 0.05, "range_max": 12.0} | changes
    written = []
    for k, ((x, y, yaw), scan) in enumerate(zip(way(len(ranges)).tolist(), ranges, strict=True)):
        at = START + k * PERIOD
        written.append(Written("/odom", at, Odom(at, x, y, yaw)))
        written.append(Written("/scan", at + 1, Scan(at, scan, "base_link", **fields)))
    return written


def carmen(ranges: Readings, *params: str) -> list[str]:
    """The lines of a CARMEN log of scans (S, B), after PARAM lines."""
    scans = [
        flaser(k / 10, tuple(scan), tuple(pose))
        for k, (scan, pose) in enumerate(zip(ranges.tolist(), way(len(ranges)).tolist(), strict=True))
    ]
    return [f"PARAM {param} nohost 0" for param in params] + scans
