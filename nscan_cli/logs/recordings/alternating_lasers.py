"""Two lasers whose scans alternate on one topic with one frame: how those of the first are recognised."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.recordings.decoded_messages import ScanMessage
from nscan_cli.logs.recordings.sweep_segments import TimedScan
from nscan_cli.poses import Array, Indices


@dataclass(frozen=True)
class TwoLaserOptions:
    """When the scans of a topic are those of two lasers."""

    sample: int = 128
    """Number of scans that are compared with the next two. A larger value takes longer."""
    first_of: int = 8
    """One in this number of these is compared first; the others are not if there is clearly one laser. A
    larger value takes less time."""
    one_laser_share: float = 0.5
    """There is clearly one laser if a smaller share of these resembles the second next. A larger value takes
    less time."""
    min_scans: int = 20
    """Least number of scans of a topic that are tested. A larger value finds fewer lasers."""
    min_compared: int = 10
    """Least number of beams with a return in both of two scans that are compared. A larger value compares
    fewer scans."""
    min_difference: float = 0.05
    """Least difference between the scans of two lasers, as a share of the ranges: it is 0.09 where one is
    0.4 m ahead of the other in an office. A larger value finds fewer lasers; a smaller one takes noise for
    them."""
    max_ratio: float = 0.75
    """Greatest ratio of the difference between a scan and the second next to that between it and the next, if
    the second next is of the same laser. A larger value finds more lasers."""
    missing_factor: float = 16.0
    """A scan of one laser is missing if the others then resemble those of their laser so much more, in the
    product of their differences. A larger value misses fewer."""
    least_difference: float = 0.001
    """Scans that differ less, as a share of the ranges, are alike. A larger value tells less of lasers that
    see nearly the same."""
    min_share: float = 0.6
    """Least share of scans with at most that ratio: one laser on a robot that drives has 0.12 at most, and
    two that look the same way have 0.75. A larger value finds fewer lasers."""


def first_of_two_lasers(messages: Sequence[TimedScan]) -> tuple[list[TimedScan], str]:
    """The scans of the first laser alone, and the message for the user; all scans if there is one laser."""
    scans = [message.scan for message in messages]
    if not _alternate(scans):
        return list(messages), ""
    is_first = _is_first(scans)
    kept = [message for message, first in zip(messages, is_first.tolist(), strict=True) if first]
    said = (
        f"two lasers alternate in one frame, {scans[0].frame}: a scan resembles the one after the next; "
        f"only the {len(kept)} scans of the laser that comes first are read, which may need --mount; "
        "give each laser its own topic and frame; --as-recorded reads all as those of one laser"
    )
    return kept, said


def _alternate(scans: Sequence[ScanMessage]) -> bool:
    """Whether scans resemble the second next, and not the next."""
    options = TwoLaserOptions()
    if len(scans) < options.min_scans:
        return False
    rows = np.unique(np.linspace(0, len(scans) - 3, options.sample).astype(np.int64))
    _, share = _differences(scans, rows[:: options.first_of])
    if share < options.one_laser_share:
        return False
    to_next, share = _differences(scans, rows)
    return to_next >= options.min_difference and share >= options.min_share


def _differences(scans: Sequence[ScanMessage], rows: Indices) -> tuple[float, float]:
    """The median difference between some scans and the next, and the share that resembles the second next.

    Zeros where no scans compare.
    """
    options = TwoLaserOptions()
    to_next, to_second = (
        np.array([_difference(scans[row], scans[row + later], options.min_compared) for row in rows.tolist()])
        for later in (1, 2)
    )
    known = np.isfinite(to_next) & np.isfinite(to_second)
    if not known.any():
        return 0.0, 0.0
    alternates = to_second[known] <= options.max_ratio * to_next[known]
    return float(np.median(to_next[known])), float(alternates.mean())


def _is_first(scans: Sequence[ScanMessage]) -> NDArray[np.bool_]:
    """(S,) whether each scan is of the laser of the first one.

    The lasers alternate, unless one of a laser is missing: then two scans of the other follow each other.
    Scans are shared out so that each resembles the one before of its laser, in the product of their
    differences, and none is missing without need: where the robot turns on the spot a scan may well resemble
    that of the other laser more.
    """
    options = TwoLaserOptions()
    before = np.array([
        [
            _difference(scan, scans[row - lag], options.min_compared) if row >= lag else np.nan
            for lag in (1, 2, 3)
        ]
        for row, scan in enumerate(scans)
    ])  # fmt: skip
    costs = np.nan_to_num(np.log(np.maximum(before, options.least_difference)))
    missing = math.log(options.missing_factor)
    # Of a scan of the other laser than the one before, and of one of the same laser.
    alternates, repeats = 0.0, math.inf
    is_after_repeat: NDArray[np.bool_] = np.zeros((len(scans), 2), dtype=np.bool_)
    for row in range(2, len(scans)):
        to_latest, to_second, to_third = costs[row].tolist()
        # The one before the two of the other laser.
        ways = alternates + to_second, repeats + to_third
        is_after_repeat[row] = ways[1] < ways[0], repeats < alternates
        alternates, repeats = min(ways), min(alternates, repeats) + to_latest + missing
    is_repeat: NDArray[np.bool_] = np.zeros(len(scans), dtype=np.bool_)
    is_repeat[-1] = repeats < alternates
    for row in range(len(scans) - 1, 1, -1):
        is_repeat[row - 1] = is_after_repeat[row, int(is_repeat[row])]
    changes = np.where(is_repeat, 0, 1)
    changes[0] = 0
    first: NDArray[np.bool_] = np.cumsum(changes) % 2 == 0
    return first


def _difference(one: ScanMessage, other: ScanMessage, min_compared: int) -> float:
    """The median difference of the ranges of two scans, as a share; nan if too few compare."""
    if len(one.ranges) != len(other.ranges):
        return np.nan
    a, b = (np.asarray(scan.ranges, dtype=np.float64) for scan in (one, other))
    there = (a > 0) & (b > 0) & np.isfinite(a) & np.isfinite(b)
    if np.count_nonzero(there) < min_compared:
        return np.nan
    apart: Array = np.abs(np.log(a[there] / b[there]))
    return float(np.median(apart))
