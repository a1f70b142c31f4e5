"""Odometry of two sources that alternate, as of two nodes that send one topic: each has its own frame.

Poses go to and fro between both. Each pose continues the source whose last one is nearer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nscan_cli.files.text import counted
from nscan_cli.logs.mask_runs import mask_runs
from nscan_cli.logs.odometry_outliers import step_sizes, usual_longest_step
from nscan_cli.logs.robot_path import steady_between
from nscan_cli.logs.steady_way import differ_from_last
from nscan_cli.poses import Array, Indices, are_known


@dataclass(frozen=True)
class TwoOdometriesOptions:
    """When poses are those of two sources."""

    factor: float = 2.5
    """A pose belongs to another source if it is farther from the last one than this multiple of the usual
    longest step. A larger value tells sources apart that differ more."""
    min_distance: float = 0.1
    """A pose of another source is farther from the last one than this, m and rad. A larger value tells
    sources apart that differ more."""
    min_poses: int = 20
    """Least number of poses. A larger value leaves more short logs."""
    min_changes: float = 0.1
    """Least share of the poses that are of the other source than the one before. It is 0.04 at most on real
    logs. A larger value finds less."""
    min_share: float = 0.2
    """Least share of the poses that each source has. A larger value finds less."""
    max_strays: float = 0.05
    """Largest share of poses that belong to neither. A larger value takes noise for a second source."""


def of_one_source(odometry: Array, times: Array) -> tuple[Array, str]:
    """Odometry (S, 3) at times (S,), s, of the source with the most poses, steady between these; and what to
    say.

    Unknown poses are nan and stay so. The text is empty where nothing is changed. A source that stands is
    none.
    """
    options = TwoOdometriesOptions()
    known = np.flatnonzero(are_known(odometry))
    recorded = odometry[known]
    # A pose that is repeated tells nothing new, and next to no step all others seem long.
    is_new = differ_from_last(recorded)
    poses = recorded[is_new]
    if len(poses) < options.min_poses:
        return odometry, ""
    limits = np.maximum(options.factor * usual_longest_step(poses), options.min_distance)
    least = options.min_changes * len(poses)
    if np.count_nonzero(_measure(poses[1:], poses[:-1], limits) > 1.0) < least:
        return odometry, ""
    source = _sources(poses, limits)
    told = np.flatnonzero(source < 2)
    shares = np.bincount(source[told], minlength=2) / len(source)
    changes = np.flatnonzero(np.diff(source[told]))
    is_open = shares.min() < options.min_share or shares.sum() < 1.0 - options.max_strays
    if is_open or len(changes) < least:
        return odometry, ""
    apart = np.median(step_sizes(poses[told[changes + 1]], poses[told[changes]]), axis=0)
    if (apart <= limits).all():
        # Poses that come in the wrong order go to and fro less far.
        return odometry, ""
    moves = [bool(np.ptp(poses[source == each], axis=0).max() > options.min_distance) for each in (0, 1)]
    used = int(np.argmax(shares * moves))
    is_used = (source == used)[np.cumsum(is_new) - 1]
    others = [(first - 1, end) for first, end in mask_runs(~is_used) if first > 0 and end < len(known)]
    evened = odometry.copy()
    evened[known] = steady_between(recorded, times[known], others)
    # Beyond the first and the last pose of the source nothing is known.
    ends = np.flatnonzero(is_used)[[0, -1]]
    evened[known[: ends[0]]] = evened[known[ends[1] + 1 :]] = np.nan
    return evened, (
        f"odometry comes from two sources that alternate, {counted(len(changes), 'time')}, {apart[0]:.3g} m "
        f"and {math.degrees(apart[1]):.2g}° apart: two nodes may send it; the one with {shares[used]:.0%} of "
        "the poses is used, and the robot is taken to move steadily between these; --as-recorded believes "
        "the log"
    )


def _sources(poses: Array, limits: Array) -> Indices:
    """(n,) the source, 0 or 1, of poses (n, 3) that differ by more than limits (2,), m and rad; 2 of those of
    neither."""
    found = np.full(len(poses), 2, dtype=np.int64)
    found[0], last = 0, np.zeros(1, dtype=np.int64)
    for row in range(1, len(poses)):
        # The robot goes on while the other source speaks.
        away = _measure(poses[[row] * len(last)], poses[last], limits) / (row - last)
        nearest = int(np.argmin(away))
        if away[nearest] <= 1.0:
            found[row] = nearest
            last[nearest] = row
        elif len(last) < 2:
            found[row], last = 1, np.append(last, row)
    return found


def _measure(poses: Array, others: Array, limits: Array) -> Array:
    """(n,) how far poses (n, 3) are from others, as a multiple of limits (2,), m and rad."""
    farthest: Array = (step_sizes(poses, others) / limits).max(axis=1)
    return farthest
