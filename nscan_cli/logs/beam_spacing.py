"""The angle between beams, checked by walls: a wrong one bends them.

Three readings of beams on one wall tell the angle between these (beam_angles.double_cosines). On a wall, two
triples about one beam tell the same angle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.beam_angles import BeamDirections, double_cosines
from nscan_cli.logs.laser_log import beam_counts
from nscan_cli.logs.raw_scans import RawScans
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array

if TYPE_CHECKING:
    from nscan_cli.logs.range_limits import RangeLimits


@dataclass(frozen=True)
class BeamSpacingOptions:
    """When walls contradict the angle between beams."""

    half_width: float = 0.45
    """Angle from a beam to those that it is compared with, rad. A larger value needs wider walls and tells
    angles more precisely."""
    narrow_half_width: float = 0.3
    """A narrower one that must tell the same, rad: noise looks like wider angles the narrower it is."""
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
    moved: float = 0.01
    """Least median change of the readings between two scans that are tested, as a share: a robot that stands
    sees one scene only. A larger value tests fewer scans."""
    max_scans: int = 200
    """Number of scans that are tested. A larger value takes longer."""
    first_of: int = 4
    """One in this number of these is tested first; the others are not where walls agree with the log. A
    larger value takes less time."""


class SampledScans(NamedTuple):
    """N scans of a sample, none of which sees what the one before saw."""

    ranges: Array
    """(N, B) readings, m; nan for those without return."""
    steps: Array
    """(N,) angle from beam to beam, rad."""


def checked_by_walls(
    raw: RawScans,
    directions: BeamDirections,
    limits: RangeLimits,
    options: ReadingOptions,
    spacing: BeamSpacingOptions = BeamSpacingOptions(),
) -> tuple[BeamDirections, list[str]]:
    """The directions, put right if walls tell a usual laser; and what is said if walls contradict them."""
    if options.as_recorded or options.angle_increment is not None:
        return directions, []
    beams = beam_counts(raw.ranges, raw.beams)
    rows = np.arange(0, len(beams), max(1, len(beams) // spacing.max_scans))
    widest = float(np.max(np.abs(directions.step) * (beams - 1)))
    # Walls mostly agree with the log, and a few scans show it.
    if _walls_agree(sampled_scans(raw, directions, limits, rows[:: spacing.first_of], spacing), spacing):
        return directions, []
    factor = _factor_of_walls(sampled_scans(raw, directions, limits, rows, spacing), spacing)
    if factor is None or factor * widest > spacing.max_view:
        return directions, []
    count = int(np.bincount(beams).argmax())
    of_count = beams == count
    first, step = (float(np.median(values[of_count])) for values in directions)
    view, is_usual = _view(abs(step) * factor, count, spacing)
    # The beams of a whole turn do not see its first direction twice.
    between = count - 1 if view < 2 * math.pi or count % 2 else count
    found = math.copysign(view / between, step)
    centred = -found * between / 2
    said = (
        f"walls are straight with {_degrees(abs(found))}° from beam to beam, {count} beams over "
        f"{_degrees(view)}°; with the {_degrees(abs(step))}° of "
        f"{'the convention for such logs' if raw.angles_assumed else 'the log'} they are bent"
    )
    is_centred = raw.angles_assumed or abs(2 * first + step * (count - 1)) < spacing.max_off_centre * abs(
        step
    )
    if is_usual and is_centred and of_count.all() and options.angle_min is None:
        ones = np.ones(len(beams))
        return BeamDirections(centred * ones, found * ones), [
            f"{said}: the {_degrees(abs(found))}° are used; --as-recorded leaves the beams as they are, "
            "--angle-increment sets another angle"
        ]
    # As options count before --flip.
    sign = -1 if options.flip else 1
    start = f" --angle-min {_degrees(sign * centred)}" if is_centred else ""
    return directions, [f"{said}; try --angle-increment {_degrees(sign * found)}{start}"]


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.4g}"


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


def _walls_agree(scans: SampledScans, options: BeamSpacingOptions) -> bool:
    """Whether more beams on walls tell the angle of the log than any other that would contradict it."""
    logs, centres, counts = _votes(scans, options.half_width, options)
    others = counts[np.abs(centres) >= options.min_difference]
    return _beams_as_log(logs, options) >= max(options.min_beams, int(others.max(initial=0)))


def _factor_of_walls(scans: SampledScans, options: BeamSpacingOptions) -> float | None:
    """The factor from the steps of scans to the angle between beams that walls tell; None if they agree.

    The angle from a beam to those that it is compared with is that of the factor found so far.
    """
    factor = 1.0
    for _ in range(options.max_rounds):
        found = _told_factor(scans, options.half_width / factor, options)
        if found is None:
            return None
        change, factor = abs(math.log(found / factor)), found
        if change < options.settled:
            narrow = _told_factor(scans, options.narrow_half_width / factor, options)
            agrees = narrow is not None and abs(math.log(narrow / factor)) <= options.agreement
            return factor if agrees else None
    return None


def _told_factor(scans: SampledScans, half_width: float, options: BeamSpacingOptions) -> float | None:
    """What most beams on walls tell; None if no factor stands out or it is near 1.

    half_width: angle from a beam to those that it is compared with by the steps of the scans, rad.
    """
    logs, centres, counts = _votes(scans, half_width, options)
    if len(centres) < options.min_beams:
        return None
    best = int(counts.argmax())
    if counts[best] < max(options.min_beams, options.min_ratio * _beams_as_log(logs, options)):
        return None
    factor = math.exp(float(np.median(logs[np.abs(logs - centres[best]) <= options.same_angle])))
    return factor if abs(math.log(factor)) >= options.min_difference else None


def _votes(
    scans: SampledScans, half_width: float, options: BeamSpacingOptions
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Sorted logarithms (V,) of the factors that beams on walls tell, those (C,) within `max_factor`, and how
    many (C,) are as these.
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


def _beams_as_log(logs: Array, options: BeamSpacingOptions) -> int:
    """How many of some sorted logarithms of factors (V,) tell the angle of the log."""
    return int(_within(logs, np.zeros(1), options.same_angle)[0])


def _within(values: Array, centres: Array, width: float) -> NDArray[np.int64]:
    """How many of some sorted values (N,) lie within a width of each centre (M,)."""
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


def _view(step: float, beams: int, options: BeamSpacingOptions) -> tuple[float, bool]:
    """The field of view (rad) of a number of beams with such a step (rad): if near, a usual one."""
    view = step * (beams - 1)
    usual = min(options.usual_views, key=lambda angle: abs(math.log(angle / view)))
    is_usual = abs(math.log(usual / view)) <= options.usual_view
    return (usual if is_usual else view), is_usual
