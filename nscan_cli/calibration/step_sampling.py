"""Which steps of a log are measured: a few that tell most, or one after another."""

from __future__ import annotations

import numpy as np

from nscan_cli.calibration.step_options import StepOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.steady_way import differ_from_last
from nscan_cli.poses import Indices, relative


def telling_steps(log: LaserLog, options: StepOptions, count: int | None = None) -> tuple[Indices, Indices]:
    """The rows (n,) where steps begin and end: spread over the log, and where odometry turns most.

    There are `count` of each, by default `options.count`.
    """
    count = count or options.count
    first, last = possible_steps(log, options)
    if not len(first):
        return first, last
    chosen = [np.linspace(0, len(first) - 1, count).astype(np.int64)]
    if log.odometry is not None:
        turns = np.abs(relative(log.odometry[last], log.odometry[first])[:, 2])
        turns = np.minimum(np.nan_to_num(turns), options.max_turn)
        # Many more than are measured, so that these come from all over the log.
        most = np.sort(np.argsort(-turns, kind="stable")[: options.turning_excess * count])
        chosen.append(most[np.linspace(0, len(most) - 1, count).astype(np.int64)])
    both = np.unique(np.concatenate(chosen))
    return first[both], last[both]


def successive_steps(log: LaserLog, options: StepOptions) -> tuple[Indices, Indices]:
    """The rows (n,) where successive steps begin and end; of very many, about `options.most`.

    No two steps overlap, so their errors are independent. In a long log, chains of `options.chain` steps are
    spread evenly.
    """
    first, last = possible_steps(log, options)
    chosen, free = [], 0
    for at, (begin, end) in enumerate(zip(first.tolist(), last.tolist(), strict=True)):
        if begin >= free:
            chosen.append(at)
            free = end
    kept = np.array(chosen, dtype=np.int64)
    if len(kept) > options.most:
        begins = np.linspace(0, len(kept) - options.chain, options.most // options.chain).astype(np.int64)
        kept = kept[np.unique(begins[:, None] + np.arange(options.chain))]
    return first[kept], last[kept]


def possible_steps(log: LaserLog, options: StepOptions) -> tuple[Indices, Indices]:
    """Each row that a step can begin at, and the first row that is far enough in time.

    Scans that repeat the one before, bit by bit, are left out: they saw nothing at their own time.
    """
    some = log.ranges[:, :: max(log.ranges.shape[1] // options.compared_beams, 1)].view(np.int32)
    rows = np.flatnonzero(differ_from_last(some))
    times = log.times[rows]
    first = np.arange(len(rows))
    last = np.maximum(np.searchsorted(times, times + options.duration), first + 1)
    first, last = first[last < len(rows)], last[last < len(rows)]
    kept = times[last] - times[first] <= options.max_duration
    return rows[first[kept]], rows[last[kept]]
