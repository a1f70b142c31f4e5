"""Directions of the beams, from options or the log; walls decide between contradicting angles of a log."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.text import counted
from nscan_cli.logs.laser_log import beam_counts
from nscan_cli.logs.raw_scans import RawScans
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array


@dataclass(frozen=True)
class BeamAngleOptions:
    """When first and last direction of a scan contradict the step, and what walls say of it."""

    least_steps_off: float = -1.5
    """Least tolerated error of a last direction, in steps: drivers count beams or the steps between, and
    round. A larger value finds more contradictions."""
    most_steps_off: float = 2.5
    """Largest tolerated error of a last direction, in steps. A larger value finds fewer contradictions."""
    max_scans: int = 200
    """Number of scans whose walls are tested. A larger value takes longer."""
    max_half_width: float = 0.5
    """Largest angle between two beams that are compared, rad. A larger value needs wider walls."""
    min_difference: float = 0.03
    """Least difference of 2 cos(k s) of two steps s, above noise of 1 %. A larger value needs wider walls."""
    max_deviation: float = 0.02
    """Largest deviation of a beam on a wall from 2 cos(k s). A larger value takes more for walls."""
    min_votes: int = 200
    """Least number of beams on walls for a decision. A larger value decides in fewer logs."""
    min_vote_ratio: float = 1.5
    """Least ratio of the beams on walls by the two steps. A larger value decides in fewer logs."""


class BeamDirections(NamedTuple):
    """Where the beams of each scan point."""

    first: Array
    """(S,) direction of the first beam, rad"""
    step: Array
    """(S,) angle from beam to beam, rad"""


def beam_directions(raw: RawScans, options: ReadingOptions, warnings: list[str]) -> BeamDirections:
    """The directions of the beams from the options, else from the log."""
    checks = BeamAngleOptions()
    size = len(raw.stamps)
    first, step = raw.angle_min, raw.angle_increment
    if options.angle_increment is not None:
        step = np.full(size, options.angle_increment)
    else:
        step = _steps(raw, warnings, checks)
    if options.angle_min is not None:
        first = np.full(size, options.angle_min)
    return BeamDirections(-first, -step) if options.flip else BeamDirections(first, step)


def _steps(raw: RawScans, warnings: list[str], checks: BeamAngleOptions) -> Array:
    """The steps (S,) from beam to beam, corrected if first and last direction and the walls contradict them.

    Other programs use the step, so that a wrong step is noticed sooner than a wrong last direction. The step
    is wrong if walls are straighter with that of the last direction, or if it alone exceeds a revolution.
    """
    steps = raw.angle_increment
    if raw.angle_max is None:
        return steps
    between = beam_counts(raw.ranges, raw.beams) - 1
    view = raw.angle_max - raw.angle_min
    with np.errstate(divide="ignore", invalid="ignore"):
        others = view / between
        wrong = _contradict(view, steps, between, checks)
    rows = np.flatnonzero(wrong)
    if not len(rows):
        return steps
    step, other, turn = steps[rows[0]], others[rows[0]], abs(steps[rows[0]]) * between[rows[0]]
    some = rows[:: -(-len(rows) // checks.max_scans)]
    straight = second_is_straighter(raw.ranges[some], steps[some], others[some], checks)
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


def _contradict(
    view: Array, steps: Array, between: NDArray[np.int64], checks: BeamAngleOptions
) -> NDArray[np.bool_]:
    """(S,) whether the angle from first to last beam (rad) contradicts the steps `between` them."""
    off = view / steps - between
    turn = 2 * math.pi / np.abs(steps)
    # A last direction may be written modulo a turn.
    within = (between <= turn + 1) & (np.abs(view / steps) <= turn + 1)
    fits = np.zeros(len(view), dtype=np.bool_)
    for more in (0, 1, -1):
        away = off + more * turn
        fits |= (checks.least_steps_off <= away) & (away <= checks.most_steps_off) & (within | (more == 0))
    # A last direction that equals the first, or is no number, was never set.
    found: NDArray[np.bool_] = np.isfinite(view) & (view != 0) & (between > 0) & ~fits
    return found


def second_is_straighter(
    rows: Iterable[NDArray[np.float32]],
    ones: Iterable[float],
    others: Iterable[float],
    options: BeamAngleOptions = BeamAngleOptions(),
) -> bool | None:
    """Whether the second of two steps (rad) of each scan makes walls straighter; None if that is unclear.

    `rows` are the readings (B,) of each scan, m; unusable ones are infinite or not above 0.
    """
    first = second = 0
    for ranges, one, other in zip(rows, ones, others, strict=True):
        votes = _beams_on_walls(ranges, np.abs([one, other]), options)
        first, second = first + votes[0], second + votes[1]
    most = max(first, second)
    least = max(options.min_votes, options.min_vote_ratio * min(first, second))
    return None if most < least else second > first


def _beams_on_walls(ranges: NDArray[np.float32], steps: Array, options: BeamAngleOptions) -> tuple[int, int]:
    """Number of beams of a scan on walls by each of two steps (2,); 0 if walls cannot tell them apart."""
    beams = len(ranges)
    if not 0 < steps.max() <= options.max_half_width:
        return 0, 0
    for k in range(1, min((beams - 1) // 2, int(options.max_half_width / steps.max())) + 1):
        first, second = 2 * np.cos(k * steps)
        if abs(first - second) >= options.min_difference:
            break
    else:
        return 0, 0
    with np.errstate(divide="ignore", invalid="ignore"):
        near = 1 / np.where((ranges > 0) & np.isfinite(ranges), ranges, np.nan).astype(np.float64)
        found = double_cosines(near, k)
    within = min(options.max_deviation, abs(first - second) / 4)
    by_one, by_other = (int(np.count_nonzero(np.abs(found - value) < within)) for value in (first, second))
    return by_one, by_other


def double_cosines(near: Array, k: int) -> Array:
    """2 cos u (…, B − 2 k) of the angle u from each beam to those `k` places beside it, as a wall has it.

    `near` (…, B) are 1 / r, 1/m. On a wall at distance d with normal direction α, a beam in direction φ
    measures 1 / r = cos(φ − α) / d. Those at angles −u and u from it thus satisfy
    1 / r₋ + 1 / r₊ = 2 cos(u) / r.
    """
    beams = near.shape[-1]
    found: Array = (near[..., : beams - 2 * k] + near[..., 2 * k :]) / near[..., k : beams - k]
    return found


def _degrees_text(angle: float) -> str:
    return f"{round(math.degrees(angle), 3):g}°"
