"""What walls tell of the angle between beams: three readings of beams on one wall tell it.

These lie on one wall if two triples about the middle beam tell the same (beam_angles.double_cosines).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.beam_angles import BeamDirections, double_cosines
from nscan_cli.logs.range_limits import RangeLimits
from nscan_cli.logs.raw_scans import RawScans
from nscan_cli.poses import Array


@dataclass(frozen=True)
class BeamSpacingOptions:
    """When walls contradict the angle between beams."""

    half_width: float = 0.45
    """Angle from a beam to those that it is compared with, rad. A larger value needs wider walls and tells
    angles more precisely."""
    narrow_half_width: float = 0.3
    """A narrower angle that must tell the same, rad: noise looks like wider angles between beams the narrower
    it is. A larger value contradicts more logs."""
    agreement: float = 0.1
    """Largest difference of what the two tell, as a share. A larger value contradicts more logs."""
    settled: float = 0.02
    """The angle is found once it changes by less than this share from one round to the next. A larger value
    is faster and less exact."""
    max_rounds: int = 5
    """Largest number of rounds. A larger value contradicts more logs."""
    same_wall: float = 0.15
    """Largest difference of the angles that two triples about a beam tell, as a share. A larger value takes
    more of what is no wall for one."""
    same_angle: float = 0.06
    """Largest difference of angles that count as one, as a share. A larger value gathers more beams."""
    min_beams: int = 200
    """Least number of beams on walls that tell another angle. A larger value contradicts fewer logs."""
    min_ratio: float = 2.0
    """Least ratio of these beams to those that tell the angle of the log. A larger value contradicts fewer
    logs."""
    min_difference: float = 0.15
    """Least difference from the angle of the log, as a share. A larger value contradicts fewer logs."""
    min_small_difference: float = 0.06
    """Least difference from the angle of the log that most parts of it tell, as a share. A larger value
    contradicts fewer logs."""
    widest_half_width: float = 0.6
    """Angle from a beam to those that it is compared with for small differences, rad. A larger value needs
    wider walls and tells angles more precisely."""
    small_agreement: float = 0.04
    """Largest difference of what `widest_half_width` and `half_width` tell of a small difference, as a share.
    A larger value contradicts more logs."""
    parts: int = 5
    """Number of parts of the log, most of which must tell a small difference. More parts contradict fewer
    logs."""
    min_beams_of_part: int = 40
    """Least number of beams on walls in a part. A larger value contradicts fewer logs."""
    part_agreement: float = 2.0
    """A part tells the same difference if the logarithms of both are within this factor of each other. A
    larger value contradicts more logs."""
    max_factor: float = 2.5
    """Largest factor between the angle of the log and that of the walls. A larger value contradicts more
    logs."""
    max_view: float = math.radians(380)
    """Largest field of view that the angle found may give, rad. A larger value contradicts more logs."""
    max_off_centre: float = 3.0
    """A laser looks ahead if it has fewer beams more than this on one side. With a larger value the angles of
    more logs are put right, and not only named."""
    usual_views: tuple[float, ...] = tuple(map(math.radians, (100, 120, 180, 190, 240, 255, 270, 360)))
    """Fields of view of lasers, rad. With more of them more logs are put right."""
    usual_view: float = 0.06
    """Largest difference of a field of view from a usual one that it is taken for, as a share. A larger value
    puts more logs right."""
    usual_view_near: float = 0.02
    """Largest difference from a usual view, as a share, where the angle of the log is wrong by less than
    `min_difference`. A larger value puts more logs right."""
    usual_view_round: float = 0.03
    """Largest difference from a usual view, as a share, where moreover the angle from beam to beam would be a
    multiple of a quarter of a degree. A larger value puts more logs right."""
    usual_view_square: float = 0.012
    """Largest difference from a usual view, as a share, that walls tell which are square to each other. A
    larger value puts more logs right."""
    moved: float = 0.01
    """Least median change of the readings between two scans that are tested, as a share: a robot that stands
    sees one scene only. A larger value tests fewer scans."""
    max_scans: tuple[int, ...] = (200, 1000)
    """Numbers of scans that are tested: more of them where walls disagree with the log, and few tell another
    angle. More take longer."""
    first_of: int = 4
    """One in this number of these is tested first; the others are not where walls agree with the log. A
    larger value takes less time."""


class SampledScans(NamedTuple):
    """N scans of a sample, none of which sees what the one before saw."""

    ranges: Array
    """(N, B) readings, m; nan for those without return."""
    steps: Array
    """(N,) angle from beam to beam, rad."""


def sampled_scans(
    raw: RawScans, directions: BeamDirections, limits: RangeLimits, rows: NDArray[np.int64]
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
        if 2 * np.count_nonzero(change > BeamSpacingOptions.moved) > np.count_nonzero(change >= 0.0):
            moved.append(row)
    return SampledScans(ranges[moved], np.abs(directions.step[rows[moved]]))


def factors_by_walls(scans: SampledScans, half_width: float) -> tuple[Array, Array, NDArray[np.int64]]:
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
            rows, steps = _told_steps(scans.ranges[those], half)
            told.append(steps - np.log(scans.steps[those])[rows])
    logs = np.sort(np.concatenate(told))
    centres = logs[np.abs(logs) <= math.log(BeamSpacingOptions.max_factor)]
    return logs, centres, _within(logs, centres, BeamSpacingOptions.same_angle)


def beams_as_log(logs: Array) -> int:
    """How many of some sorted logarithms of factors (V,) tell the angle of the log."""
    return int(_within(logs, np.zeros(1), BeamSpacingOptions.same_angle)[0])


def _within(values: Array, centres: Array, width: float) -> NDArray[np.int64]:
    """(M,) the number of sorted values (N,) within a width of each centre (M,)."""
    ends = np.searchsorted(values, centres + width, side="right")
    found: NDArray[np.int64] = ends - np.searchsorted(values, centres - width)
    return found


def _told_steps(ranges: Array, half: int) -> tuple[NDArray[np.int64], Array]:
    """Rows (V,) of beams of scans (N, B) on walls, and logarithms (V,) of the angles that they tell."""
    near = 1 / ranges
    wide = _log_angles(near, 2 * half) - math.log(2 * half)
    narrow = _log_angles(near, half)[:, half : ranges.shape[1] - 3 * half] - math.log(half)
    with np.errstate(invalid="ignore"):
        rows, beams = np.nonzero(np.abs(wide - narrow) < BeamSpacingOptions.same_wall)
    return rows, wide[rows, beams]


def _log_angles(near: Array, between: int) -> Array:
    """Logarithm of the angle u from each beam to those `between` places before and after it; nan where none.

    near: 1 / r (N, B) in 1/m. The angle is that of beams on one wall; the result has B − 2 `between` places.
    """
    cosines = 0.5 * double_cosines(near, between)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.log(np.arccos(np.where(cosines < 1, np.maximum(cosines, -1.0), np.nan)))


def most_told_factor(logs: Array, centres: Array, counts: NDArray[np.int64]) -> float:
    """The factor that most beams tell, from what `factors_by_walls` returns."""
    best = centres[int(counts.argmax())]
    return math.exp(float(np.median(logs[np.abs(logs - best) <= BeamSpacingOptions.same_angle])))
