"""Stretches in which no beam comes back: a driver died, something covers the laser, or nothing is near."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.mask_runs import mask_runs, stretch_names
from nscan_cli.poses import Indices


@dataclass(frozen=True)
class BlindScanOptions:
    """When scans count as blind."""

    min_scans: int = 10
    """Least number of such scans in a row that are named. A larger value names less."""


def blind_scans(ranges: NDArray[np.float32], numbers: Indices) -> list[str]:
    """The messages on scans with ranges (S, B) and numbers (S,) that see nothing for long.

    In an open field it is no fault, but nothing is mapped there, either.
    """
    is_blind = np.logical_not(np.isfinite(ranges).any(axis=1))
    runs = [run for run in mask_runs(is_blind) if run[1] - run[0] >= BlindScanOptions.min_scans]
    if not runs:
        return []
    names = stretch_names((int(numbers[first]), int(numbers[end - 1])) for first, end in runs)
    return [
        f"the laser sees nothing from scan {names}: odometry alone tells the way there, or nothing does "
        "without odometry"
    ]
