"""Directions of the beams, from options or the log; walls decide between contradicting angles of a log."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.text import counted
from nscan_cli.logs.laser_log import beam_counts
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.wall_straightness import second_is_straighter
from nscan_cli.poses import Array

if TYPE_CHECKING:
    from nscan_cli.logs.assemble import RawScans

TOLERATED_STEPS = (-1.5, 2.5)
"""Tolerated error of a last direction, in steps. Drivers count beams or the steps between, and round."""
MAX_SCANS_TESTED = 200
"""Number of scans whose walls are tested. A larger value takes longer."""


class BeamDirections(NamedTuple):
    """Where the beams of each scan point."""

    first: Array
    """(S,) direction of the first beam, rad"""
    step: Array
    """(S,) angle from beam to beam, rad"""


def beam_directions(raw: RawScans, options: ReadingOptions, warnings: list[str]) -> BeamDirections:
    """The directions of the beams from the options, else from the log."""
    size = len(raw.stamps)
    first, step = raw.angle_min, raw.angle_increment
    if options.angle_increment is not None:
        step = np.full(size, options.angle_increment)
    else:
        step = _steps(raw, warnings)
    if options.angle_min is not None:
        first = np.full(size, options.angle_min)
    return BeamDirections(-first, -step) if options.flip else BeamDirections(first, step)


def _steps(raw: RawScans, warnings: list[str]) -> Array:
    """The steps (S,) from beam to beam, corrected if first and last direction and the walls contradict them.

    Other programs use the step, so that a wrong step is noticed sooner than a wrong last direction. The step
    is wrong if walls are straighter with that of the last direction, or if it alone exceeds a whole turn.
    """
    steps = raw.angle_increment
    if raw.angle_max is None:
        return steps
    between = beam_counts(raw.ranges, raw.beams) - 1
    view = raw.angle_max - raw.angle_min
    with np.errstate(divide="ignore", invalid="ignore"):
        others = view / between
        wrong = _contradict(view, steps, between)
    rows = np.flatnonzero(wrong)
    if not len(rows):
        return steps
    step, other, turn = steps[rows[0]], others[rows[0]], abs(steps[rows[0]]) * between[rows[0]]
    some = rows[:: -(-len(rows) // MAX_SCANS_TESTED)]
    straight = second_is_straighter(raw.ranges[some], steps[some], others[some])
    if straight is not None:
        last, why = straight, "walls are straight with"
    else:
        last = turn > 2 * math.pi + abs(step) and abs(view[rows[0]]) <= 2 * math.pi + abs(other)
        why = "the scans do not show which is right; other programs use"
        if last:
            why = "the beams would cover more than a turn; the last direction gives"
    used, left = (other, step) if last else (step, other)
    where = "" if len(rows) == len(steps) else f"in {len(rows)} of {counted(len(steps), 'scan')} "
    end = raw.angle_min[rows[0]] + step * between[rows[0]]
    warnings.append(
        f"{where}the last direction (angle_max) is {_degrees_text(raw.angle_max[rows[0]])}, but with the "
        f"angle between beams (angle_increment) of {_degrees_text(step)} "
        f"{counted(int(between[rows[0]]) + 1, 'beam')} end at {_degrees_text(end)}: {why} "
        f"{_degrees_text(used)} per beam, which is used; "
        f"--angle-increment {math.degrees(left):.6g} chooses the other"
    )
    return np.where(wrong, others, steps) if last else steps


def _contradict(view: Array, steps: Array, between: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(S,) whether the angle from first to last beam (rad) contradicts the steps `between` them."""
    off = view / steps - between
    turn = 2 * math.pi / np.abs(steps)
    # A last direction may be written modulo a turn.
    within = (between <= turn + 1) & (np.abs(view / steps) <= turn + 1)
    fits = np.zeros(len(view), dtype=np.bool_)
    for more in (0, 1, -1):
        fits |= (
            (TOLERATED_STEPS[0] <= off + more * turn)
            & (off + more * turn <= TOLERATED_STEPS[1])
            & (within | (more == 0))
        )
    # A last direction that equals the first, or is no number, was never set.
    found: NDArray[np.bool_] = np.isfinite(view) & (view != 0) & (between > 0) & ~fits
    return found


def _degrees_text(angle: float) -> str:
    return f"{round(math.degrees(angle), 3):g}°"
