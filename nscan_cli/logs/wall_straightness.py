"""How far apart a scan's beams are, as the scan itself tells: walls are straight with the right step alone.

On a wall that a beam in direction φ meets at r, 1 / r = cos(φ − α) / d. So beams k steps of s before and
after a beam have 1 / r₋ + 1 / r₊ = 2 cos(k s) / r.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Readings = NDArray[np.float32]
WIDEST = 0.5
"""rad; a wall seldom reaches farther to each side of a beam."""
TELLING = 0.03
"""The least difference between the two values of 2 cos(k s) that noise of a hundredth does not hide."""
FINEST = 0.02
"""Values that are nearer to each other than this are the same."""
MIN_WALL_POINTS = 200
"""So many places on walls tell."""
CLEARLY = 1.5
"""Times as many than on the walls of the other step."""


def second_is_straighter(
    rows: Iterable[Readings], ones: Iterable[float], others: Iterable[float]
) -> bool | None:
    """Whether the second of two steps (rad) of each scan makes straighter walls; None where it is not clear.

    rows: the readings (B,) of each scan, m; those that do not count are not above 0, or infinite.
    """
    first = second = 0
    for ranges, one, other in zip(rows, ones, others, strict=True):
        votes = _on_walls(ranges, one, other)
        first, second = first + votes[0], second + votes[1]
    most = max(first, second)
    return None if most < MIN_WALL_POINTS or most < CLEARLY * min(first, second) else second > first


def _on_walls(ranges: Readings, one: float, other: float) -> tuple[int, int]:
    """How many beams of a scan are on a wall by each of two steps; 0 where walls do not tell these apart."""
    steps = np.abs([one, other])
    beams = len(ranges)
    if not 0 < steps.max() <= WIDEST:
        return 0, 0
    for k in range(1, min((beams - 1) // 2, int(WIDEST / steps.max())) + 1):
        first, second = 2 * np.cos(k * steps)
        if abs(first - second) >= TELLING:
            break
    else:
        return 0, 0
    with np.errstate(divide="ignore", invalid="ignore"):
        near = 1 / np.where((ranges > 0) & np.isfinite(ranges), ranges, np.nan).astype(np.float64)
        found = (near[: beams - 2 * k] + near[2 * k :]) / near[k : beams - k]
    within = min(FINEST, abs(first - second) / 4)
    by_one, by_other = (int(np.count_nonzero(np.abs(found - value) < within)) for value in (first, second))
    return by_one, by_other
