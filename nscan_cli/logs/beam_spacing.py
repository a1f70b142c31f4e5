"""The angle between beams, checked by walls: a wrong one bends them.

Where the angle of the log is far off (15 %), it is enough that most beams on walls tell another one. Where it
is nearly right, most parts of the log must tell about the same other one; or walls are square to each other
with another one (square_walls.py), which tells a percent.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from nscan_cli.logs.beam_angles import BeamDirections
from nscan_cli.logs.laser_log import beam_counts
from nscan_cli.logs.range_limits import RangeLimits
from nscan_cli.logs.raw_scans import RawScans
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_parts import evenly
from nscan_cli.logs.square_walls import SeenSquare, SquareWallOptions, told_by_square_walls
from nscan_cli.logs.wall_angles import (
    BeamSpacingOptions,
    SampledScans,
    beams_as_log,
    factors_by_walls,
    most_told_factor,
    sampled_scans,
)


def checked_by_walls(
    raw: RawScans, directions: BeamDirections, limits: RangeLimits, options: ReadingOptions
) -> tuple[BeamDirections, list[str]]:
    """The directions, put right if walls tell a usual laser; and messages if walls contradict them."""
    spacing = BeamSpacingOptions()
    if options.as_recorded or options.angle_increment is not None:
        return directions, []
    beams = beam_counts(raw.ranges, raw.beams)
    widest, factor, square = float(np.max(np.abs(directions.step) * (beams - 1))), 1.0, None
    few, *_ = samples = [np.arange(0, len(beams), max(1, len(beams) // count)) for count in spacing.max_scans]
    # Walls mostly agree with the log, and a few scans show it.
    if not _walls_agree(sampled_scans(raw, directions, limits, few[:: spacing.first_of])):
        for rows in samples:
            scans = sampled_scans(raw, directions, limits, rows)
            factor = _factor_of_walls(scans) or _factor_of_parts(scans) or 1.0
            if factor != 1.0:
                break
    is_bent = factor != 1.0

    def sample(count: int) -> SampledScans:
        """So many scans, with the angle that straight walls tell."""
        some = sampled_scans(raw, directions, limits, evenly(len(beams), count))
        return SampledScans(some.ranges, factor * some.steps)

    if factor * widest <= SquareWallOptions().max_view:
        square = told_by_square_walls(sample)
    if square is None and not is_bent:
        return directions, []
    told = factor * (square.factor if square is not None else 1.0)
    if told * widest > spacing.max_view:
        return directions, []
    count = int(np.bincount(beams).argmax())
    of_count = beams == count
    # Readings of some scans may come in the other order.
    orders = np.sign(directions.step)
    first, step = (float(np.median((values * orders)[of_count])) for values in directions)
    if np.median(orders) < 0:
        first, step = -first, -step
    view, is_usual = _view(abs(step) * told * (count - 1), told, count, not is_bent)
    found = math.copysign(_between(view, count), step)
    if square is not None and not is_bent and not _contradicts(square, found / step, is_usual):
        return directions, []
    centred = -math.copysign(view, step) / 2
    seen, not_seen = ("straight", "bent") if is_bent else ("square to each other", "not")
    said = (
        f"walls are {seen} with {_degrees(abs(found))}° from beam to beam, {count} beams over "
        f"{_degrees(view)}°; with the {_degrees(abs(step))}° of "
        f"{'the convention for such logs' if raw.angles_assumed else 'the log'} they are {not_seen}"
    )
    off_by_log, off_by_walls = (abs(2 * first / angle + count - 1) for angle in (step, found))
    is_centred = raw.angles_assumed or min(off_by_log, off_by_walls) < spacing.max_off_centre
    if off_by_walls <= min(off_by_log, spacing.max_off_centre):
        # The first direction of the log is that of a laser that looks ahead.
        centred = first
    if is_usual and is_centred and of_count.all() and options.angle_min is None:
        same = orders * np.sign(step)
        return BeamDirections(centred * same, found * same), [
            f"{said}: the {_degrees(abs(found))}° are used; --as-recorded leaves the beams as they are, "
            "--angle-increment sets another angle"
        ]
    # As options count before --flip.
    sign = -1 if options.flip else 1
    start = f" --angle-min {_degrees(sign * centred)}" if is_centred else ""
    return directions, [f"{said}; try --angle-increment {_degrees(sign * found)}{start}"]


def _contradicts(square: SeenSquare, factor: float, is_usual: bool) -> bool:
    """Whether walls that are square contradict the angle of the log; `factor` leads from it to the one that
    they tell, or one near that with a usual view."""
    options = SquareWallOptions()
    return abs(math.log(factor)) >= options.min_share if is_usual else square.is_clear(options)


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.4g}"


def _between(view: float, beams: int) -> float:
    """The angle (rad) from one of some beams to the next over a field of view.

    The last beam is one step before its end where it would see the first direction of a turn again, or where
    the step is a round one else.
    """
    is_open = beams % 2 == 0 and (view >= 2 * math.pi or _is_round(view / beams))
    return view / (beams if is_open else beams - 1)


def _is_round(step: float) -> bool:
    """Whether an angle (rad) is a multiple of a quarter of a degree."""
    quarters = 4 * math.degrees(step)
    return abs(quarters - round(quarters)) < 1e-6


def _walls_agree(scans: SampledScans) -> bool:
    """Whether most beams on walls tell the angle of the log, or nearly that."""
    options = BeamSpacingOptions()
    _logs, centres, counts = factors_by_walls(scans, options.widest_half_width)
    best = int(counts.argmax()) if len(counts) else 0
    return (
        len(counts) > 0
        and counts[best] >= options.min_beams
        and abs(float(centres[best])) < options.min_small_difference
    )


def _factor_of_walls(scans: SampledScans) -> float | None:
    """The factor from the steps of scans to the angle between beams that walls tell; None if they agree."""
    options = BeamSpacingOptions()

    def told(half_width: float) -> float | None:
        return _told_factor(scans, half_width)

    factor = _settled(told, options.half_width)
    narrow = None if factor is None else told(options.narrow_half_width / factor)
    if factor is None or narrow is None or abs(math.log(narrow / factor)) > options.agreement:
        return None
    return factor


def _factor_of_parts(scans: SampledScans) -> float | None:
    """The factor that most beams on walls tell, if it differs from 1 in most parts of the log.

    None if it does not, or if other angles to the beams compared tell another one.
    """
    options = BeamSpacingOptions()
    # If beams are much farther apart than in the log, hardly any wall is as wide as it says.
    start = _told_factor(scans, options.narrow_half_width) or 1.0

    def told(some: SampledScans, half_width: float, min_beams: int) -> float | None:
        return _settled(lambda width: _most_told(some, width, min_beams), half_width, start)

    factor = told(scans, options.widest_half_width, options.min_beams)
    if factor is None or abs(math.log(factor)) < options.min_small_difference:
        return None
    other = told(scans, options.half_width, options.min_beams)
    if other is None or abs(math.log(other / factor)) > options.small_agreement:
        return None
    agreeing = 0
    for rows in np.array_split(np.arange(len(scans.ranges)), options.parts):
        part = SampledScans(scans.ranges[rows], scans.steps[rows])
        of_part = told(part, options.widest_half_width, options.min_beams_of_part)
        share = 0.0 if of_part is None else math.log(of_part) / math.log(factor)
        if 1.0 / options.part_agreement < share < options.part_agreement:
            agreeing += 1
    return factor if 2 * agreeing > options.parts else None


def _settled(told: Callable[[float], float | None], half_width: float, start: float = 1.0) -> float | None:
    """The factor that is `told` once the angle (rad) to the beams compared is right by that factor itself.

    It is looked for from `start` on. None if none is told, or if it does not settle.
    """
    factor = start
    for _ in range(BeamSpacingOptions.max_rounds):
        found = told(half_width / factor)
        if found is None:
            return None
        change, factor = abs(math.log(found / factor)), found
        if change < BeamSpacingOptions.settled:
            return factor
    return None


def _most_told(scans: SampledScans, half_width: float, min_beams: int) -> float | None:
    """The factor that most beams on walls tell; None for too few. `half_width` as in `_told_factor`."""
    logs, centres, counts = factors_by_walls(scans, half_width)
    return None if counts.max(initial=0) < min_beams else most_told_factor(logs, centres, counts)


def _told_factor(scans: SampledScans, half_width: float) -> float | None:
    """What most beams on walls tell; None if no factor stands out or it is near 1.

    half_width: angle from a beam to those that it is compared with by the steps of the scans, rad.
    """
    options = BeamSpacingOptions()
    logs, centres, counts = factors_by_walls(scans, half_width)
    if len(centres) < options.min_beams:
        return None
    best = int(counts.argmax())
    if counts[best] < max(options.min_beams, options.min_ratio * beams_as_log(logs)):
        return None
    factor = most_told_factor(logs, centres, counts)
    return factor if abs(math.log(factor)) >= options.min_difference else None


def _view(view: float, factor: float, beams: int, is_square: bool) -> tuple[float, bool]:
    """The field of view (rad) of so many beams that walls tell, or a usual one near it; and whether it is
    that. `factor` is that of the log's angle, and `is_square` whether only walls that are square tell it."""
    options = BeamSpacingOptions()
    usual = min(options.usual_views, key=lambda angle: abs(math.log(angle / view)))
    near = options.usual_view
    if is_square:
        near = options.usual_view_square
    elif abs(math.log(factor)) < options.min_difference:
        near = options.usual_view_round if _is_round(_between(usual, beams)) else options.usual_view_near
    is_usual = abs(math.log(usual / view)) <= near
    return (usual if is_usual else view), is_usual
