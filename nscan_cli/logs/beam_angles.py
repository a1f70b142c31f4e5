"""Where the beams of a log point: as the user says, as the log does, or as the scans decide between two."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.counting import counted
from nscan_cli.logs.laser_log import beam_counts
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.wall_straightness import second_is_straighter
from nscan_cli.poses import Array

if TYPE_CHECKING:
    from nscan_cli.logs.assemble import RawScans

USUAL = (-1.5, 2.5)
"""Steps that a last direction may be off: drivers count beams or the steps between, and round up or down."""
LOOKED_AT = 200
"""Scans."""


def beam_directions(raw: RawScans, options: ReadingOptions, warnings: list[str]) -> tuple[Array, Array]:
    """First direction and step (S,) of each scan, rad, as the user says, else as the log does."""
    size = len(raw.stamps)
    first, step = raw.angle_min, raw.angle_increment
    if options.angle_increment is not None:
        step = np.full(size, options.angle_increment)
    else:
        step = _steps(raw, warnings)
    if options.angle_min is not None:
        first = np.full(size, options.angle_min)
    return (-first, -step) if options.flip else (first, step)


def _steps(raw: RawScans, warnings: list[str]) -> Array:
    """The steps (S,) from beam to beam where first and last direction may contradict them.

    Those who read messages go by the step, and so a wrong one is noticed sooner than a wrong last
    direction. The scans' walls may show that it is wrong, and so does a step that leads round further
    than a turn where the last direction does not.
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
    some = rows[:: -(-len(rows) // LOOKED_AT)]
    straight = second_is_straighter(raw.ranges[some], steps[some], others[some])
    if straight is not None:
        last, why = straight, "walls are straight with"
    else:
        last = turn > 2 * math.pi + abs(step) and abs(view[rows[0]]) <= 2 * math.pi + abs(other)
        why = "the scans do not tell which is right; readers go by"
        if last:
            why = "the beams would go round more than once; by the former it is"
    used, left = (other, step) if last else (step, other)
    where = "" if len(rows) == len(steps) else f"in {len(rows)} of {counted(len(steps), 'scan')} "
    end = raw.angle_min[rows[0]] + step * between[rows[0]]
    warnings.append(
        f"{where}the last direction (angle_max) is {_degrees(raw.angle_max[rows[0]])}, but by the angle "
        f"between beams (angle_increment) of {_degrees(step)} {counted(int(between[rows[0]]) + 1, 'beam')} "
        f"end at {_degrees(end)}: {why} {_degrees(used)} a beam, which is used; "
        f"--angle-increment {math.degrees(left):.6g} says otherwise"
    )
    return np.where(wrong, others, steps) if last else steps


def _contradict(view: Array, steps: Array, between: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(S,) whether the angles from first to last beam (rad) are not those of so many steps."""
    off = view / steps - between
    turn = 2 * math.pi / np.abs(steps)
    # A last direction may be written without the turn that leads there.
    within = (between <= turn + 1) & (np.abs(view / steps) <= turn + 1)
    fits = np.zeros(len(view), dtype=np.bool_)
    for more in (0, 1, -1):
        fits |= (USUAL[0] <= off + more * turn) & (off + more * turn <= USUAL[1]) & (within | (more == 0))
    # A last direction that is the first, or no number, was never set.
    found: NDArray[np.bool_] = np.isfinite(view) & (view != 0) & (between > 0) & ~fits
    return found


def _degrees(angle: float) -> str:
    return f"{round(math.degrees(angle), 3):g}°"
