"""A test of the angle between beams by the straightness of walls.

On a wall at distance d with normal direction α, a beam in direction φ measures 1 / r = cos(φ − α) / d. Beams
k steps of s before and after a beam therefore satisfy 1 / r₋ + 1 / r₊ = 2 cos(k s) / r.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Readings = NDArray[np.float32]
MAX_HALF_WIDTH = 0.5
"""Largest angle k s, rad. Walls seldom extend farther to each side of a beam."""
MIN_DIFFERENCE = 0.03
"""Smallest difference between the values of 2 cos(k s) of two steps that noise of 1 % does not hide."""
MAX_DEVIATION = 0.02
"""Largest deviation of a beam on a wall from 2 cos(k s)."""
MIN_VOTES = 200
"""Smallest number of beams on walls for a decision."""
MIN_VOTE_RATIO = 1.5
"""Smallest ratio of the beams on walls by the chosen step to those by the other one."""


def second_is_straighter(
    rows: Iterable[Readings], ones: Iterable[float], others: Iterable[float]
) -> bool | None:
    """Whether the second of two steps (rad) of each scan makes walls straighter; None if that is unclear.

    rows: the readings (B,) of each scan, m. Unusable ones are infinite or not above 0.
    """
    first = second = 0
    for ranges, one, other in zip(rows, ones, others, strict=True):
        votes = _beams_on_walls(ranges, one, other)
        first, second = first + votes[0], second + votes[1]
    most = max(first, second)
    return None if most < MIN_VOTES or most < MIN_VOTE_RATIO * min(first, second) else second > first


def _beams_on_walls(ranges: Readings, one: float, other: float) -> tuple[int, int]:
    """Number of beams of a scan on walls by each of two steps; 0 if walls cannot distinguish the steps."""
    steps = np.abs([one, other])
    beams = len(ranges)
    if not 0 < steps.max() <= MAX_HALF_WIDTH:
        return 0, 0
    for k in range(1, min((beams - 1) // 2, int(MAX_HALF_WIDTH / steps.max())) + 1):
        first, second = 2 * np.cos(k * steps)
        if abs(first - second) >= MIN_DIFFERENCE:
            break
    else:
        return 0, 0
    with np.errstate(divide="ignore", invalid="ignore"):
        near = 1 / np.where((ranges > 0) & np.isfinite(ranges), ranges, np.nan).astype(np.float64)
        found = (near[: beams - 2 * k] + near[2 * k :]) / near[k : beams - k]
    within = min(MAX_DEVIATION, abs(first - second) / 4)
    by_one, by_other = (int(np.count_nonzero(np.abs(found - value) < within)) for value in (first, second))
    return by_one, by_other
