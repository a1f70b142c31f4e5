"""How far two paths of the same drive differ: relative positions over ways of some length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.poses import Array, Indices, Mask, relative
from nscan_cli.slam.consistency.options import VerificationOptions
from nscan_cli.slam.consistency.repeated_maps import MappedPath


@dataclass(frozen=True)
class PathDifference:
    """How far paths differ over ways of one length."""

    way: float
    """Length of the path, m."""
    median: float
    """m"""
    p95: float
    """95 % quantile, m."""
    max: float
    """m"""
    first: int
    """Row of the first scan of the way on which they differ most."""
    last: int
    """Row of its last scan."""
    sigma: float | None = None
    """Standard deviation (m) that the graph says of the relative position there; None if it is unknown."""


def path_differences(
    path: MappedPath, repeat: MappedPath, options: VerificationOptions
) -> list[PathDifference]:
    """The differences of a path and of its repeat, which has some of its scans, over each length.

    The relative poses of the first and the last scan of a way are compared. A length is left out if no way is
    that long without a break, without a gap, and without scans of which the repeat alone does not tell the
    place or contradicts its own.
    """
    at = np.searchsorted(path.rows, repeat.rows)
    one, other = path.poses[at], repeat.poses
    if len(one) < 2:
        return []
    along = _way(one[:, :2], options.least_move)
    apart = np.cumsum(np.concatenate([[False], _is_apart(one, path, repeat, options)]))
    found = []
    for way in options.ways:
        last = np.searchsorted(along, along + way)
        first = np.flatnonzero(last < len(along))
        first = first[apart[last[first]] == apart[first]]
        if len(first):
            found.append(_difference(way, repeat.rows, one, other, first, last[first]))
    return found


def _way(places: Array, least: float) -> Array:
    """(n,) the way to each of places (n, 2), m, in straight pieces of at least a length.

    A robot that stands seems to tremble by some millimetres from scan to scan, which add up.
    """
    corners = [0]
    for row in range(1, len(places)):
        if np.hypot(*(places[row] - places[corners[-1]])) >= least:
            corners.append(row)
    pieces = np.hypot(*np.diff(places[corners], axis=0).T)
    way: Array = np.interp(np.arange(len(places)), corners, np.append(0.0, np.cumsum(pieces)))
    return way


def _is_apart(poses: Array, path: MappedPath, repeat: MappedPath, options: VerificationOptions) -> Mask:
    """(n - 1,) whether a step from scan to scan is too far to say that the repeat must follow, or breaks."""
    steps = relative(poses[1:], poses[:-1])
    far = (np.hypot(steps[:, 0], steps[:, 1]) > options.max_step) | (np.abs(steps[:, 2]) > options.max_turn)
    # What the repeat alone guesses says nothing of the path.
    guessed = np.setdiff1d(
        np.union1d(repeat.degenerate, repeat.standing_rows(options.start)), path.degenerate
    )
    apart = np.unique(np.concatenate([path.breaks, repeat.breaks, repeat.contradicted, guessed]))
    broken = np.searchsorted(repeat.rows, apart) - 1
    far[np.clip(broken, 0, len(far) - 1)] = True
    return far


def _difference(
    way: float, rows: Indices, one: Array, other: Array, first: Indices, last: Indices
) -> PathDifference:
    off = relative(one[last], one[first]) - relative(other[last], other[first])
    size = np.hypot(off[:, 0], off[:, 1])
    worst = int(size.argmax())
    median, p95 = np.quantile(size, (0.5, 0.95)).tolist()
    return PathDifference(
        way, median, p95, float(size[worst]), int(rows[first[worst]]), int(rows[last[worst]])
    )
