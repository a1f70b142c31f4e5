"""Successive measured steps, added up: over a longer time, errors of the stamps matter less.

If stamps are now too late and now too early, the turn of a short step is compared with odometry of another
time. The two then agree less, and the fitted ratio comes out too small.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.calibration.measured_steps import MeasuredSteps
from nscan_cli.poses import Indices


def chains(steps: MeasuredSteps, longest: int) -> Indices:
    """The first steps (c,) of chains of up to `longest` steps, each of which begins where the one before
    ends."""
    follows = np.append(False, steps.first[1:] == steps.last[:-1])
    begins: list[int] = []
    for at, is_next in enumerate(follows.tolist()):
        if not begins or not is_next or at - begins[-1] >= longest:
            begins.append(at)
    return np.array(begins, dtype=np.int64)
