"""Stretches in which no beam comes back, or a few: the laser is covered, or nothing is near."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.text import counted
from nscan_cli.logs.mask_runs import mask_runs, stretch_names
from nscan_cli.poses import Indices


@dataclass(frozen=True)
class BlindScanOptions:
    """When scans count as blind."""

    min_scans: int = 10
    """Least number of such scans in a row that are named. A larger value names less."""
    min_returns: int = 10
    """A scan with fewer returns, and than a quarter of its beams, tells hardly anything; tracking leaves it
    to odometry. A larger value names more."""


def least_returns(beams: int, usual: int) -> int:
    """The least number of returns of a scan that tells something: the `usual` one, or a quarter of few
    beams."""
    return min(usual, beams // 4)


def blind_scans(ranges: NDArray[np.float32], numbers: Indices) -> list[str]:
    """The messages on scans with ranges (S, B) and numbers (S,) that see nothing, or hardly anything, for
    long.

    In an open field it is no fault, but nothing is mapped there, either.
    """
    options = BlindScanOptions()
    least = least_returns(ranges.shape[1], options.min_returns)
    returns = np.count_nonzero(np.isfinite(ranges), axis=1)
    is_blind = returns < max(least, 1)
    runs = [run for run in mask_runs(is_blind) if run[1] - run[0] >= options.min_scans]
    if not runs:
        return []
    names = stretch_names((int(numbers[first]), int(numbers[end - 1])) for first, end in runs)
    sees_some = any(returns[first:end].any() for first, end in runs)
    what = f"has less than {counted(least, 'return')}" if sees_some else "sees nothing"
    return [
        f"the laser {what} from scan {names}: odometry alone tells the way there, or nothing does without "
        "odometry"
    ]
