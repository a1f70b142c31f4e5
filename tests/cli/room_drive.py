"""What a robot records that drives in a room, for tests of commands on recordings."""

from __future__ import annotations

import numpy as np

from tests.logs.recordings.drives import PERIOD, START, Odom, Scan, Tf, Written

COUNT = 24


def room_drive() -> list[Written]:
    """A robot that drives along a room of 6 × 4 m, with 60 beams to the front."""
    angles = np.radians(-90 + 3 * np.arange(60))
    written = [Written("/tf_static", START, (Tf(START, "base_link", "laser", (0.0, 0.0, 0.2)),))]
    for k in range(COUNT):
        at, x = START + k * PERIOD, 0.1 * k
        with np.errstate(divide="ignore"):
            front, side = (6 - x) / np.cos(angles), 2 / np.abs(np.sin(angles))
        ranges = np.minimum(np.where(front > 0, front, np.inf), side).astype(np.float32)
        written.append(Written("/odom", at, Odom(at, x, 0.0, 0.0)))
        written.append(Written("/scan", at, Scan(at, ranges, angle_min=angles[0], step=np.radians(3))))
    return written
