"""Where odometry and scans disagree about how far the robot came.

Tracking believes the scans: wheels spin. But along a bare corridor, behind glass, or with somebody who walks
along, scans tell of less way than there was, and nothing but the odometry knows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.poses import Array

STRETCH = 5.0
"""Ways are compared over so many metres: over less, noise counts too much."""
SHARE = 0.4
"""They disagree when the shorter one is shorter than the longer by more than this share of it. Odometry that
is sound is off by less than half of this, with disturbed steps too."""


class Disagreement(NamedTuple):
    """A stretch of the path."""

    first: int
    """Rows of the keyframes at its ends."""
    last: int
    by_odometry: float
    """Length of the way, m."""
    by_scans: float


def disagreements(
    rows: NDArray[np.int64], poses: Array, odometry: Array, breaks: Sequence[int]
) -> list[Disagreement]:
    """The stretches over which they disagree, of K keyframes in rows (K,), at poses (K, 3).

    Odometry (S, 3) has all scans; nothing is compared over the rows at which tracking broke.
    """
    ways = np.stack([_steps(odometry[rows]), _steps(poses)])
    pieces = np.searchsorted(np.asarray(breaks, dtype=np.int64), rows, side="right")
    ways[:, pieces[1:] > pieces[:-1]] = 0.0
    along = np.cumsum(np.append(0.0, ways.max(axis=0)))
    until = np.searchsorted(along, along + STRETCH)
    since = np.flatnonzero(until < len(rows))
    until = until[since]
    lengths = np.concatenate([np.zeros((2, 1)), np.cumsum(ways, axis=1)], axis=1)
    over = lengths[:, until] - lengths[:, since]
    wrong = over.max(axis=0) - over.min(axis=0) > SHARE * over.max(axis=0)
    # Stretches that overlap are one.
    change = np.zeros(len(rows) + 1, dtype=np.int64)
    np.add.at(change, since[wrong], 1)
    np.add.at(change, until[wrong], -1)
    inside = np.append(False, np.cumsum(change) > 0)
    firsts, lasts = (np.flatnonzero(inside[1:] & ~inside[:-1]), np.flatnonzero(~inside[1:] & inside[:-1]))
    return [
        Disagreement(int(rows[a]), int(rows[b]), *(lengths[:, b] - lengths[:, a]).tolist())
        for a, b in zip(firsts, lasts, strict=True)
    ]


def _steps(poses: Array) -> Array:
    """(K − 1,) how far (m) it is from each pose (K, 3) to the next."""
    steps = np.diff(poses[:, :2], axis=0)
    return np.hypot(steps[:, 0], steps[:, 1])
