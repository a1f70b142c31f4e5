"""What walls tell of the angle between beams: three readings of beams on one wall tell it.

These lie on one wall if two triples about the middle beam tell the same (beam_angles.double_cosines).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.beam_angles import BeamDirections, double_cosines
from nscan_cli.logs.beam_spacing_options import BeamSpacingOptions
from nscan_cli.logs.raw_scans import RawScans
from nscan_cli.poses import Array

if TYPE_CHECKING:
    from nscan_cli.logs.range_limits import RangeLimits


class SampledScans(NamedTuple):
    """N scans of a sample, none of which sees what the one before saw."""

    ranges: Array
    """(N, B) readings, m; nan for those without return."""
    steps: Array
    """(N,) angle from beam to beam, rad."""


def sampled_scans(
    raw: RawScans,
    directions: BeamDirections,
    limits: RangeLimits,
    rows: NDArray[np.int64],
    options: BeamSpacingOptions,
) -> SampledScans:
    """The scans in some rows whose readings have changed since the one before."""
    ranges = raw.ranges[rows].astype(np.float64)
    with np.errstate(invalid="ignore"):
        is_usable = (ranges > np.maximum(0.0, limits.low[rows, None])) & (ranges < limits.high[rows, None])
    ranges[~is_usable] = np.nan
    moved = [0]
    for row in range(1, len(rows)):
        last = ranges[moved[-1]]
        change = np.abs(ranges[row] - last) / last
        if 2 * np.count_nonzero(change > options.moved) > np.count_nonzero(change >= 0.0):
            moved.append(row)
    return SampledScans(ranges[moved], np.abs(directions.step[rows[moved]]))


def factors_by_walls(
    scans: SampledScans, half_width: float, options: BeamSpacingOptions
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Factors by which walls say that the angle between beams is larger than in the log, as logarithms.

    Returns all of them, sorted (V,); those within `max_factor` (C,); and for each of these the number of all
    that differ from it by `same_angle` at most (C,).
    """
    told, halves = [np.zeros(0)], np.zeros(len(scans.steps), dtype=np.int64)
    some = scans.steps > 0.0
    # No more than there are beams: a damaged log may have hardly any angle between them.
    halves[some] = np.rint(np.minimum(half_width / scans.steps[some] / 2, scans.ranges.shape[1]))
    for half in np.unique(halves[halves > 0]).tolist():
        if 4 * half < scans.ranges.shape[1]:
            those = halves == half
            rows, steps = _told_steps(scans.ranges[those], half, options)
            told.append(steps - np.log(scans.steps[those])[rows])
    logs = np.sort(np.concatenate(told))
    centres = logs[np.abs(logs) <= math.log(options.max_factor)]
    return logs, centres, _within(logs, centres, options.same_angle)


def beams_as_log(logs: Array, options: BeamSpacingOptions) -> int:
    """How many of some sorted logarithms of factors (V,) tell the angle of the log."""
    return int(_within(logs, np.zeros(1), options.same_angle)[0])


def _within(values: Array, centres: Array, width: float) -> NDArray[np.int64]:
    """(M,) the number of sorted values (N,) within a width of each centre (M,)."""
    ends = np.searchsorted(values, centres + width, side="right")
    found: NDArray[np.int64] = ends - np.searchsorted(values, centres - width)
    return found


def _told_steps(ranges: Array, half: int, options: BeamSpacingOptions) -> tuple[NDArray[np.int64], Array]:
    """Rows (V,) of beams of scans (N, B) on walls, and logarithms (V,) of the angles that they tell."""
    near = 1 / ranges
    wide = _log_angles(near, 2 * half) - math.log(2 * half)
    narrow = _log_angles(near, half)[:, half : ranges.shape[1] - 3 * half] - math.log(half)
    with np.errstate(invalid="ignore"):
        rows, beams = np.nonzero(np.abs(wide - narrow) < options.same_wall)
    return rows, wide[rows, beams]


def _log_angles(near: Array, between: int) -> Array:
    """Logarithm of the angle u from each beam to those `between` places before and after it; nan where none.

    near: 1 / r (N, B) in 1/m. The angle is that of beams on one wall; the result has B − 2 `between` places.
    """
    cosines = 0.5 * double_cosines(near, between)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.log(np.arccos(np.where(cosines < 1, np.maximum(cosines, -1.0), np.nan)))


def most_told_factor(
    logs: Array, centres: Array, counts: NDArray[np.int64], options: BeamSpacingOptions
) -> float:
    """The factor that most beams tell, from what `factors_by_walls` returns."""
    best = centres[int(counts.argmax())]
    return math.exp(float(np.median(logs[np.abs(logs - best) <= options.same_angle])))
