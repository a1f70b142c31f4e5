"""Readings that begin in the middle of the scan: both halves exchanged, or all moved on by some beams.

Walls go on from each beam to the next, but not from the last to the first of a laser with a limited view:
these look elsewhere. If readings go on there, and not at some place between, the first beam is behind it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.logs.beam_angles import BeamDirections
from nscan_cli.logs.laser_log import beam_counts
from nscan_cli.logs.range_limits import RangeLimits
from nscan_cli.logs.raw_scans import RawScans
from nscan_cli.logs.robot_parts import evenly
from nscan_cli.logs.wall_angles import sampled_scans
from nscan_cli.poses import Array, Indices


@dataclass(frozen=True)
class RolledReadingOptions:
    """When readings begin in the middle of the scan."""

    max_view: float = math.radians(330.0)
    """The beams cover this at most, rad: all around there is no first one. A larger value checks more
    lasers."""
    scans: int = 256
    """Number of scans that are compared, evenly spread. More take longer."""
    min_scans: int = 20
    """Least number of different scans with readings of both beams. A larger value checks fewer logs."""
    max_change: float = 0.05
    """Readings go on from one beam to another if the usual logarithm of their ratio is less: between both
    ends of real lasers it is 0.2 and more. A larger value finds more."""
    min_change: float = 0.15
    """They do not go on where it is more than this. A smaller value finds more."""
    min_ratio: float = 3.0
    """It is larger there than at any other place beside by this factor. A smaller value finds more."""


def with_first_beam_first(
    raw: RawScans,
    directions: BeamDirections,
    limits: RangeLimits,
    options: RolledReadingOptions = RolledReadingOptions(),
) -> tuple[RawScans, list[str]]:
    """The scans with the readings in the order of the beams, and the messages."""
    beams = beam_counts(raw.ranges, raw.beams)
    count = int(beams[0])
    view = count * float(np.median(np.abs(directions.step)))
    if (beams != count).any() or count < 3 or view > options.max_view:
        return raw, []
    some = evenly(len(beams), options.scans)
    # Mostly the two ends tell that all is well.
    if not _usual_changes(_walls(raw, limits, some, [count - 1, 0]), options)[0] <= options.max_change:
        return raw, []
    # One place of a robot that stands is any place.
    seen = sampled_scans(raw, directions, limits, some).ranges[:, :count]
    if not _usual_changes(seen[:, [count - 1, 0]], options)[0] <= options.max_change:
        return raw, []
    changes = _usual_changes(seen, options)
    known = np.where(np.isfinite(changes), changes, 0.0)
    at = int(np.argmax(known))
    others = np.delete(known, at)
    if known[at] < max(options.min_change, options.min_ratio * float(others.max(initial=0.0))):
        return raw, []
    first = at + 1
    ranges = raw.ranges.copy()
    ranges[:, :count] = np.roll(raw.ranges[:, :count], -first, axis=1)
    return replace(raw, ranges=ranges), [
        f"the readings begin in the middle of the scan, with that of beam {count - first}: walls go on from "
        f"the last one to the first, and not from number {at} to {first}; they are read in the order of the "
        "beams; --as-recorded leaves them as they are"
    ]


def _walls(raw: RawScans, limits: RangeLimits, rows: Indices, beams: list[int]) -> Array:
    """(n, b) the readings of some beams of scans (n,), m; nan for those beyond the limits."""
    found = raw.ranges[rows[:, None], beams].astype(np.float64)
    found[~((found > limits.low[rows, None]) & (found < limits.high[rows, None]))] = np.nan
    return found


def _usual_changes(ranges: Array, options: RolledReadingOptions) -> Array:
    """(B − 1,) the median logarithm, without sign, of the ratio of readings (S, B) beside each other; nan for
    few."""
    changes = np.abs(np.diff(np.log(ranges), axis=1))
    told = np.count_nonzero(np.isfinite(changes), axis=0) >= options.min_scans
    found = np.full(changes.shape[1], np.nan)
    if told.any():
        found[told] = np.nanmedian(changes[:, told], axis=0)
    return found
