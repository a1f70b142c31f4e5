"""Ranges that all change by one factor from one scan to the next: a driver or a laser that was exchanged.

Odometry predicts each scan from the one before. Where the usual factor between both is not 1, scans before
and behind are matched at several scales: a wrong step of odometry explains such a factor as well, and then
the scans match best as they are.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nscan_cli.calibration.compared_ranges import ComparedRanges, laser_steps
from nscan_cli.calibration.odometry_units import metres_by_scans
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.parabola import parabola_minimum
from nscan_cli.calibration.range_jump_options import RangeJumpOptions
from nscan_cli.calibration.thinned_scans import thinned_scan
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.mask_runs import mask_runs, stretch_names
from nscan_cli.matching.scan_pairs import match_scans
from nscan_cli.poses import Array, compose, wrap


class RangeJump(NamedTuple):
    """A scan from which on all ranges are multiplied."""

    row: int
    factor: float


def checked_ranges(
    log: LaserLog, compared: ComparedRanges, options: FileCheckOptions
) -> tuple[LaserLog, list[str]]:
    """The log with all of its ranges in one scale, and the messages. `compared` are its scans."""
    jumps = range_jumps(log, compared, options)
    if not jumps:
        return log, []
    scales = _scales(len(log), jumps, options.jumps)
    scales /= _right_scale(log, scales, options)
    is_wrong = np.abs(np.log(scales)) > options.jumps.wrong_share * math.log(options.jumps.min_factor)
    names = stretch_names(log.numbers[[first, end - 1]].tolist() for first, end in mask_runs(is_wrong))
    factors = sorted({f"{scale:.3g}" for scale in scales[is_wrong].tolist()})
    other = log.range_scale * float(scales[is_wrong][0])
    message = (
        f"the ranges of scans {names} are {' or '.join(factors)} times the others, as all of them change "
        "from one scan to the next: they are divided by it; if the others are wrong instead, "
        f"--range-scale {other:.3g}; --as-recorded uses them as they are"
    )
    ranges = log.ranges.copy()
    ranges[is_wrong] /= scales[is_wrong, None].astype(np.float32)
    return replace(log, ranges=ranges), [message]


def _scales(size: int, jumps: list[RangeJump], options: RangeJumpOptions) -> Array:
    """(size,) the scales of all scans, that of the first is 1; a scale that comes back is the same again."""
    scales, known = np.ones(size), [1.0]
    for jump in jumps:
        scale = known[-1] * jump.factor
        known.append(min(known, key=lambda each: abs(math.log(each / scale))))
        if abs(math.log(known[-1] / scale)) > options.refinement:
            known[-1] = scale
        scales[jump.row :] = known[-1]
    return scales


def range_jumps(log: LaserLog, compared: ComparedRanges, options: FileCheckOptions) -> list[RangeJump]:
    """The scans from which on all ranges are multiplied, in order."""
    jumps, logarithms, shares = options.jumps, compared.logarithms, compared.shares
    if len(log) < 4:
        return []
    sizes = np.abs(np.nan_to_num(logarithms))
    is_odd = (sizes > math.log(jumps.min_factor)) & (shares >= jumps.min_share)
    # Two scans before each place and two behind are matched.
    is_alone = np.maximum(sizes[:-2], sizes[2:]) < jumps.max_beside * sizes[1:-1]
    places = np.flatnonzero(is_odd[1:-1] & is_alone) + 1
    best = places[np.argsort(-shares[places], kind="stable")[: jumps.max_candidates]]
    found = []
    for place in np.sort(best).tolist():
        factor = _matched_factor(log, place + 1, float(np.exp(logarithms[place])), options)
        if factor is not None:
            found.append(RangeJump(place + 1, factor))
    return found


def pairs_across(row: int) -> list[tuple[int, int]]:
    """The pairs of one of the two rows before `row` and of one of the two from it on, nearest first."""
    return [(row - 1, row), (row - 2, row), (row - 1, row + 1), (row - 2, row + 1)]


def scans_to_match(
    log: LaserLog, first: int, last: int, options: FileCheckOptions
) -> tuple[Array, Array, Array] | None:
    """The points of two scans, (m, 2) and (n, 2), and the step (3,) of the laser between them by odometry;
    None for too few points."""
    before, behind = (thinned_scan(log, row, options.steps) for row in (first, last))
    if before is None or behind is None:
        return None
    return before.points, behind.points, laser_steps(log, np.array([first]), np.array([last]))[0]


def _matched_factor(log: LaserLog, row: int, factor: float, options: FileCheckOptions) -> float | None:
    """The factor of the ranges from a row on by matches, near to one; None if scans match better as they
    are."""
    jumps, pairs, as_read = options.jumps, pairs_across(row), []
    for first, last in pairs:
        # Two scales tell nearly always that nothing changes.
        some = _energies(log, first, last, [1.0, factor], options)
        if some is None or some[1] > some[0]:
            return None
        as_read.append(some[0])
    # Beams that meet other walls than before make the usual factor some percent wrong.
    near = math.log(factor) + jumps.refinement * np.arange(-jumps.reach, jumps.reach + 1)
    coarse = _energies(log, *pairs[0], np.exp(near).tolist(), options)
    if coarse is None:
        return None
    near = near[np.argmin(coarse)] + jumps.refinement * np.arange(-2.0, 3.0)
    factor = math.exp(near[2])
    # Where scans match better at another scale for other reasons, those of one side do so, too.
    for first in (row - 2, row):
        some = _energies(log, first, first + 1, [1.0, factor], options)
        if some is None or some[0] > some[1] - jumps.min_gain:
            return None
    energies = [_energies(log, first, last, np.exp(near).tolist(), options) for first, last in pairs]
    of_all = np.array(energies)
    total = of_all.sum(axis=0)
    best = int(np.argmin(total))
    if best in (0, len(near) - 1) or (of_all[:, best] > np.array(as_read) - jumps.min_gain).any():
        return None
    if not _agree(log, row, math.exp(near[best]), options):
        return None
    found = parabola_minimum(near, total)
    return math.exp(found) if abs(found) > math.log(jumps.min_factor) else None


def _agree(log: LaserLog, row: int, scale: float, options: FileCheckOptions) -> bool:
    """Whether the matches with the ranges from a row on divided by a scale agree with each other and with
    odometry, and are better than those of the scans as they are."""
    jumps = options.jumps
    before, behind = (_ScaledMatch.of(log, first, first + 1, 1.0, options) for first in (row - 2, row))
    # Odometry may be wrong there, and the robot go on as before.
    across = [_ScaledMatch.of(log, *rows, scale, options, before.step) for rows in pairs_across(row)]
    if any(each.gain <= jumps.min_gain for each in across):
        return False
    # A slope that comes into view lets all ranges grow as well, and the scans match after a wrong step.
    if across[0].misfit > max(before.misfit, behind.misfit) + jumps.max_misfit:
        return False
    sides = before.step, behind.step / (scale, scale, 1.0)
    return lead_one_way([each.step for each in across], sides, jumps.max_off, jumps.max_turn_off)


def _energies(
    log: LaserLog, first: int, last: int, scales: list[float], options: FileCheckOptions
) -> Array | None:
    """(n,) energy per point of two scans, the later one divided by each scale; None for too few points."""
    pair_of_scans = scans_to_match(log, first, last, options)
    if pair_of_scans is None:
        return None
    before, behind, start = pair_of_scans
    pair = options.steps.pair
    found = [match_scans(before, behind / scale, start, pair).energy for scale in scales]
    return np.array(found) / len(behind)


class _ScaledMatch(NamedTuple):
    """Two scans, matched with the later one divided by a scale."""

    gain: float
    """By how much the energy per point is lower than that of the scans as they are, matched from there on,
    or from another step: single things shift where all ranges seem to grow."""
    step: Array
    """(3,) of the laser, from the earlier scan to the later one."""
    misfit: float
    """How far the step is off that by odometry, m and rad."""

    @classmethod
    def of(
        cls,
        log: LaserLog,
        first: int,
        last: int,
        scale: float,
        options: FileCheckOptions,
        other: Array | None = None,
    ) -> _ScaledMatch:
        """The match of two rows, both of which have enough points; `other` is another step (3,)."""
        pair_of_scans = scans_to_match(log, first, last, options)
        assert pair_of_scans is not None
        before, behind, start = pair_of_scans
        scaled = match_scans(before, behind / scale, start, options.steps.pair)
        starts = [scaled.pose] if other is None else [scaled.pose, other]
        as_read = min(match_scans(before, behind, each, options.steps.pair).energy for each in starts)
        x, y, turn = (scaled.pose - start).tolist()
        misfit = math.hypot(x, y) + abs(math.remainder(turn, math.tau))
        return cls((as_read - scaled.energy) / len(behind), scaled.pose, misfit)


def lead_one_way(
    across: Sequence[Array], sides: tuple[Array, Array], max_off: float, max_turn_off: float
) -> bool:
    """Whether the four steps (3,) of `pairs_across` agree with each other and with those of both sides.

    They are off by at most so much, m and rad.
    """
    before, behind = sides
    between = across[0]
    led = (
        between,
        compose(before, between),
        compose(between, behind),
        compose(before, compose(between, behind)),
    )
    off = np.stack(across) - np.stack(led)
    is_near = np.hypot(off[:, 0], off[:, 1]) <= max_off
    return bool((is_near & (np.abs(wrap(off[:, 2])) <= max_turn_off)).all())


def _right_scale(log: LaserLog, scales: Array, options: FileCheckOptions) -> float:
    """The one of the scales of scans (S,) that is likely right: that of most scans, of equal parts the first.

    If they differ clearly, it is the one with which odometry agrees, if there is one such.
    """
    values, first, counts = np.unique(scales, return_index=True, return_counts=True)
    most = float(values[np.lexsort((first, -counts))[0]])
    if log.odometry is None or values[-1] < options.clear_scale_factor * values[0]:
        return most
    agree = []
    for value in values.tolist():
        at_scale = (scales[1:] == value) & (scales[:-1] == value)
        metres = metres_by_scans(log, at_scale, options.units, options.steps)
        if metres is not None and abs(math.log(metres)) < math.log(options.min_scale_factor):
            agree.append(value)
    return agree[0] if len(agree) == 1 else most
