"""Small logs of a robot that drives along a room of 6 × 4 m, and all outputs that `slam` can write."""

from __future__ import annotations

import numpy as np

from nscan_cli.poses import Array
from tests.logs.lines import flaser
from tests.logs.recordings.messages import PERIOD, START, Odom, Scan, Tf, Written

ALL_OUTPUTS = ["-o", "out.json", "--map", "out.png", "--trajectory", "out.tum", "--g2o", "out.g2o",
               "--carmen", "out.log", "--depfile", "out.d"]  # fmt: skip
COUNT = 24
"""Scans of room_drive()."""


def ranges_at(x: float, angles: Array) -> Array:
    """Ranges (B,) from x along the middle of the room, by beams to the front at `angles` (B,)."""
    with np.errstate(divide="ignore"):
        front, side = (6 - x) / np.cos(angles), 2 / np.abs(np.sin(angles))
    return np.minimum(np.where(front > 0, front, np.inf), side)


def room_drive() -> list[Written]:
    """The messages of a recording, with 60 beams to the front."""
    angles = np.radians(-90 + 3 * np.arange(60))
    written = [Written("/tf_static", START, (Tf(START, "base_link", "laser", (0.0, 0.0, 0.2)),))]
    for k in range(COUNT):
        at, x = START + k * PERIOD, 0.1 * k
        ranges = ranges_at(x, angles).astype(np.float32)
        written.append(Written("/odom", at, Odom(at, x, 0.0, 0.0)))
        written.append(Written("/scan", at, Scan(at, ranges, angle_min=angles[0], step=np.radians(3))))
    return written


def room_log(count: int) -> str:
    """CARMEN text, with 30 beams to the front; after 50 scans the robot is back where it began."""
    angles = np.radians(-90 + 6 * np.arange(30))
    lines = []
    for k in range(count):
        x = 0.1 * (k % 50)
        ranges = tuple(np.round(ranges_at(x, angles), 3).tolist())
        lines.append(flaser(100 + 0.2 * k, ranges, (x, 0.0, 0.0)))
    return "\n".join(lines) + "\n"
