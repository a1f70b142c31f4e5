"""Where odometry and scans disagree about how far the robot came.

Tracking believes the scans: wheels spin, and some count the way back as one ahead. But along a bare corridor,
behind glass, or with somebody who walks along, scans tell of less way than there was, and nothing but the
odometry knows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nscan_cli.poses import Array, Indices

STRETCH = 5.0
"""It is compared how far the robot came, from end to end, in so many metres of way: in less, noise counts too
much. Where it turns, the length of its way from keyframe to keyframe depends on how many there are."""
SHARE = 0.4
"""They disagree when one has come farther than the other by more than this share of the way. Odometry that is
sound is off by little more than half of this at most, with disturbed steps too."""


class OdometryDisagreement(NamedTuple):
    """A stretch of the path."""

    first: int
    """Rows of the keyframes at its ends."""
    last: int
    by_odometry: float
    """How far the robot came in one stretch after the other, m."""
    by_scans: float


def odometry_disagreements(
    rows: Indices, poses: Array, odometry: Array, breaks: Sequence[int]
) -> list[OdometryDisagreement]:
    """The stretches over which they disagree, of K keyframes in rows (K,), at poses (K, 3).

    Odometry (S, 3) has all scans; nothing is compared over the rows at which tracking broke.
    """
    pieces = np.searchsorted(np.asarray(breaks, dtype=np.int64), rows, side="right")
    tracks = np.stack([odometry[rows, :2], poses[:, :2]])
    steps = np.linalg.norm(np.diff(tracks, axis=1), axis=2).max(axis=0)
    along = np.cumsum(np.append(0.0, np.where(pieces[1:] > pieces[:-1], 0.0, steps)))
    until = np.searchsorted(along, along + STRETCH)
    since = np.flatnonzero(until < len(rows))
    since = since[pieces[since] == pieces[until[since]]]
    came = np.linalg.norm(tracks[:, until[since]] - tracks[:, since], axis=2)
    wrong = since[np.abs(came[0] - came[1]) > SHARE * (along[until[since]] - along[since])]
    # Stretches that overlap are one.
    change = np.zeros(len(rows) + 1, dtype=np.int64)
    np.add.at(change, wrong, 1)
    np.add.at(change, until[wrong], -1)
    inside = np.append(False, np.cumsum(change) > 0)
    firsts, lasts = (np.flatnonzero(inside[1:] & ~inside[:-1]), np.flatnonzero(~inside[1:] & inside[:-1]))
    return [
        OdometryDisagreement(int(rows[a]), int(rows[b]), *_lengths(tracks[:, _ends(until, a, b)]).tolist())
        for a, b in zip(firsts.tolist(), lasts.tolist(), strict=True)
    ]


def _ends(until: Indices, first: int, last: int) -> list[int]:
    """The ends of the stretches that lead one after the other from the first keyframe to the last."""
    ends = [first]
    while ends[-1] < last:
        ends.append(min(int(until[ends[-1]]), last))
    return ends


def _lengths(tracks: Array) -> Array:
    """(2,) of two ways (2, n, 2), straight from position to position, m."""
    lengths: Array = np.linalg.norm(np.diff(tracks, axis=1), axis=2).sum(axis=1)
    return lengths
