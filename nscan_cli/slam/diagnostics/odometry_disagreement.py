"""Where odometry and scans disagree about how far the robot came.

Tracking trusts the scans, because wheels spin, and some odometry counts backward as forward. But along a bare
corridor, behind glass, or beside someone who walks along, scans show less motion than there was, and only the
odometry knows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nscan_cli.logs.mask_runs import mask_runs
from nscan_cli.poses import Array, Indices, Mask, are_known, relative
from nscan_cli.slam.diagnostics.options import OdometryDisagreementOptions


class OdometryDisagreement(NamedTuple):
    """A stretch of the path."""

    first: int
    """Row of its first keyframe."""
    last: int
    """Row of its last keyframe."""
    by_odometry: float
    """Distance that the robot came by odometry, m."""
    by_scans: float
    """Distance that it came by the scans, m."""


def odometry_disagreements(
    rows: Indices, poses: Array, odometry: Array, breaks: Sequence[int], options: OdometryDisagreementOptions
) -> list[OdometryDisagreement]:
    """The stretches over which they disagree, of K keyframes in rows (K,), at poses (K, 3).

    Odometry (S, 3) is that of all scans. Nothing is compared across the rows `breaks`, at which tracking
    broke, nor where odometry is missing (nan). The distance between both ends of a stretch is compared,
    because the length of the path between them depends on how many keyframes there are in turns.
    """
    known = are_known(odometry)
    rows, poses = rows[known[rows]], poses[known[rows]]
    if not len(rows):
        return []
    begins = np.sort([*breaks, *(np.flatnonzero(known[1:] & ~known[:-1]) + 1)]).astype(np.int64)
    pieces = np.searchsorted(begins, rows, side="right")
    tracks = np.stack([odometry[rows, :2], poses[:, :2]])
    steps = np.linalg.norm(np.diff(tracks, axis=1), axis=2).max(axis=0)
    along = np.cumsum(np.append(0.0, np.where(pieces[1:] > pieces[:-1], 0.0, steps)))
    until = np.searchsorted(along, along + options.path)
    since = np.flatnonzero(until < len(rows))
    since = since[pieces[since] == pieces[until[since]]]
    came = np.linalg.norm(tracks[:, until[since]] - tracks[:, since], axis=2)
    wrong = since[np.abs(came[0] - came[1]) > options.max_share * (along[until[since]] - along[since])]
    # Stretches that overlap are one.
    change = np.zeros(len(rows) + 1, dtype=np.int64)
    np.add.at(change, wrong, 1)
    np.add.at(change, until[wrong], -1)
    found = []
    for first, last in mask_runs(np.cumsum(change) > 0):
        # Stretches that lead one after the other from the first keyframe to the last.
        ends = [first]
        while ends[-1] < last:
            ends.append(min(int(until[ends[-1]]), last))
        lengths = np.linalg.norm(np.diff(tracks[:, ends], axis=1), axis=2).sum(axis=1)
        found.append(OdometryDisagreement(int(rows[first]), int(rows[last]), *lengths.tolist()))
    return found


def carried_scans(poses: Array, odometry: Array, options: OdometryDisagreementOptions) -> Indices:
    """The scans to which the robot moved while odometry stood: rows of poses (S, 3) and odometry (S, 3)."""
    moved, by_odometry = relative(poses[1:], poses[:-1]), relative(odometry[1:], odometry[:-1])
    stood = are_known(by_odometry) & ~_longer(by_odometry, options.stood)
    return np.flatnonzero(stood & _longer(moved, options.carried)) + 1


def _longer(steps: Array, than: float) -> Mask:
    """Which steps (n, 3) are longer than some distance, m, or turn by more, rad."""
    longer: Mask = (np.hypot(steps[:, 0], steps[:, 1]) > than) | (np.abs(steps[:, 2]) > than)
    return longer
