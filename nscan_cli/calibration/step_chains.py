"""Measured steps that follow each other, added up: over a longer time the stamps matter less.

Where odometry or scans are stamped now too late and now too early, the turn of a short step is compared with
that of another time, and is as little like it as the turns of two times are: the ratio comes out too small.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.calibration.measured_steps import MeasuredSteps
from nscan_cli.poses import Indices


def chains(steps: MeasuredSteps, longest: int) -> Indices:
    """(c,) where chains of up to `longest` steps begin, each of which begins where the one before ends."""
    follows = np.append(False, steps.first[1:] == steps.last[:-1])
    begins: list[int] = []
    for at, is_next in enumerate(follows.tolist()):
        if not begins or not is_next or at - begins[-1] >= longest:
            begins.append(at)
    return np.array(begins, dtype=np.int64)
