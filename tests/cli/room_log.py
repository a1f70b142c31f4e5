"""A small log for tests of `slam`, and all outputs that it can have."""

from __future__ import annotations

import numpy as np

from tests.logs.lines import flaser

ALL_OUTPUTS = ["-o", "out.json", "--map", "out.png", "--trajectory", "out.tum", "--g2o", "out.g2o",
               "--carmen", "out.log", "--depfile", "out.d"]  # fmt: skip


def room_log(count: int) -> str:
    """CARMEN text of a robot that drives in a room of 6 × 4 m, with 30 beams to the front."""
    angles = np.radians(-90 + 6 * np.arange(30))
    lines = []
    for k in range(count):
        x = 0.1 * k
        with np.errstate(divide="ignore"):
            front = (6 - x) / np.cos(angles)
            side = 2 / np.abs(np.sin(angles))
        ranges = tuple(np.round(np.minimum(np.where(front > 0, front, np.inf), side), 3).tolist())
        lines.append(flaser(100 + 0.2 * k, ranges, (x, 0.0, 0.0)))
    return "\n".join(lines) + "\n"
