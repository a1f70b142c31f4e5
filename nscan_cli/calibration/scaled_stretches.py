"""Stretches over which the lengths of odometry are multiplied by something: a driver that restarts, say.

odometry_units.py finds those in millimetres or centimetres, at which no robot could drive so fast;
scale_change.py finds what changes once, by less. Here a few steps by scans show a stretch, more of them its
ends. It is scaled, and where it begins and ends odometry is left out.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from nscan_cli.calibration.changed_odometry import with_scaled_steps
from nscan_cli.calibration.held_odometry import without_rows
from nscan_cli.calibration.measured_steps import KnownSteps, MeasuredSteps, measure_steps
from nscan_cli.calibration.odometry_fault_options import ScaledStretchOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.robust_fit import median
from nscan_cli.calibration.step_evidence import length_sigmas
from nscan_cli.calibration.step_sampling import possible_steps, telling_steps
from nscan_cli.files.text import counted
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.mask_runs import mask_runs
from nscan_cli.poses import Array, Indices, Mask, wrap

PLACES = (0.5, 0.25, 0.75, 0.12, 0.38, 0.62, 0.88)
"""Where a step is measured to narrow down an interval, as shares of it: the next where one tells nothing."""


class ScaledStretch(NamedTuple):
    """A stretch over which odometry is multiplied by something."""

    scale: float
    """Metres by scans for one metre by odometry."""
    steps: int
    """Number of steps that show it."""
    begins: tuple[int, int]
    """Rows between which it begins: odometry is right up to the former."""
    ends: tuple[int, int]
    """Rows between which it ends: odometry is right from the latter on."""


def checked_stretches(
    log: LaserLog, options: FileCheckOptions, known: KnownSteps
) -> tuple[LaserLog, list[str]]:
    """The log with its odometry scaled over each such stretch, and messages.

    More steps are measured only if those that are `known` show one.
    """
    said = []
    found = scaled_stretches(log, options, known)
    for each in found:
        times = (float(log.times[each.begins[0]]), float(log.times[each.ends[1]]))
        log = with_scaled_steps(log, [times], each.scale)
        begin, end = log.numbers[each.begins[1]], log.numbers[each.ends[0]]
        metres = float(f"{each.scale:.3g}")
        said.append(
            f"from scan {begin} to {end} one metre by odometry is {metres:g} m by scans, in "
            f"{counted(each.steps, 'step')}, and elsewhere about one: it is multiplied by that there; "
            "--as-recorded uses it as it is"
        )
    between = [ends for each in found for ends in (each.begins, each.ends) if ends[1] - ends[0] > 1]
    return without_rows(log, [(first, last - 1) for first, last in between]), said


def scaled_stretches(log: LaserLog, options: FileCheckOptions, known: KnownSteps) -> list[ScaledStretch]:
    """The stretches, in order; none where the rest of the log is not about right."""
    if log.odometry is None:
        return []
    few = np.array(sorted(pair for pair, step in known.items() if step is not None), dtype=np.int64)
    some = options.stretches
    _, values = _told(log, _measured(log, few.reshape(-1, 2).T, options, known), some)
    is_off = np.abs(values) >= math.log(some.min_factor)
    runs = [end - first for first, end in mask_runs(is_off)]
    if max(runs, default=0) < some.first_steps or np.count_nonzero(~is_off) < some.first_steps:
        return []
    first, last = telling_steps(log, options.steps, options.more_steps)
    pairs = np.unique(np.concatenate([np.stack([first, last], axis=1), few]), axis=0)
    told, values = _told(log, _measured(log, pairs.T, options, known), some)
    # Steps with a factor near the least one are off as well.
    is_off = _as_most(np.abs(values) >= 0.5 * math.log(some.min_factor), some.beside)
    usual = values[~is_off]
    if len(usual) < some.min_steps or abs(median(usual)) > math.log(some.max_usual):
        return []
    seconds = log.times[told.last] - log.times[told.first]
    ways = np.hypot(*told.odometry(log.odometry)[:, :2].T)
    speeds = np.log(ways / np.maximum(seconds, np.finfo(float).tiny))
    aside = np.subtract(
        *(np.arctan2(each[:, 1], each[:, 0]) for each in (told.odometry(log.odometry), told.laser))
    )
    found = []
    for begin, end in mask_runs(is_off):
        middle = median(values[begin:end])
        if end - begin < some.min_steps or median(np.abs(values[begin:end] - middle)) > some.max_spread:
            continue
        if abs(middle) < math.log(some.min_factor):
            continue
        # Somebody who goes along changes steps by scans, but not how fast the robot is by odometry.
        faster = median(speeds[begin:end]) - median(speeds[~is_off])
        if not _is_nearer(np.array([-faster]), middle)[0]:
            continue
        # Odometry that stands trembles in any direction: multiplied, it does not lead the robot's way.
        if median(np.abs(wrap(aside[begin:end] - _usual_angle(aside[~is_off])))) > some.max_aside:
            continue
        # Single steps beside it may be off by something else.
        inside = begin + np.flatnonzero(_is_clear(values[begin:end], middle, middle, some))
        before = np.flatnonzero(_is_clear(values[: inside[0]], 0.0, middle, some))
        behind = inside[-1] + 1 + np.flatnonzero(_is_clear(values[inside[-1] + 1 :], 0.0, middle, some))
        begins, ends = (0, 0), (len(log) - 1, len(log) - 1)
        if len(before):
            rows = int(told.last[before[-1]]), int(told.first[inside[0]])
            begins = _border(log, *rows, middle, True, options)
        if len(behind):
            rows = int(told.last[inside[-1]]), int(told.first[behind[0]])
            ends = _border(log, *rows, middle, False, options)
        found.append(ScaledStretch(_scale(middle, some), len(inside), begins, ends))
    return found


def _usual_angle(angles: Array) -> float:
    """The direction of the mean of directions (n,), rad."""
    return float(np.angle(np.exp(1j * angles).mean()))


def _scale(value: float, options: ScaledStretchOptions) -> float:
    scale = math.exp(value)
    decimal = 10.0 ** round(math.log10(scale))
    return decimal if abs(scale / decimal - 1.0) <= options.decimal_tolerance else scale


def _measured(
    log: LaserLog, rows: Indices, options: FileCheckOptions, known: KnownSteps | None = None
) -> MeasuredSteps:
    return measure_steps(log, (rows[0], rows[1]), options.steps, known=known)


def _told(log: LaserLog, steps: MeasuredSteps, options: ScaledStretchOptions) -> tuple[MeasuredSteps, Array]:
    """The n steps that tell a scale, and its logarithms (n,): metres by scans for one by odometry."""
    assert log.odometry is not None
    lengths = np.hypot(*steps.laser[:, :2].T)
    by_odometry = np.hypot(*steps.odometry(log.odometry)[:, :2].T)
    # Along bare walls scans tell hardly any length, and too short ones.
    clear = lengths >= options.min_length
    # A laser that is not in the middle goes far where the robot turns on the spot.
    clear &= np.abs(steps.laser[:, 2]) <= options.max_turn * lengths
    clear &= length_sigmas(steps.laser, steps.covariances) <= options.max_sigma * lengths
    clear &= np.isfinite(by_odometry) & (by_odometry > 0.0)
    return steps.of(clear), np.log(lengths[clear] / by_odometry[clear])


def _is_nearer(values: Array, value: float) -> Mask:
    """(n,) which values are nearer to a value than to 0."""
    nearer: Mask = np.abs(values - value) < np.abs(values)
    return nearer


def _is_clear(values: Array, side: float, value: float, options: ScaledStretchOptions) -> Mask:
    """(n,) which values are clearly those of one side, 0 or `value`."""
    clear: Mask = np.abs(values - side) <= options.max_unclear * abs(value)
    return clear


def _as_most(is_off: Mask, beside: int) -> Mask:
    """(n,) whether most of each value and of those beside it are off."""
    padded = np.pad(is_off.astype(np.int64), beside, mode="edge")
    most: Mask = np.convolve(padded, np.ones(2 * beside + 1, dtype=np.int64), "valid") > beside
    return most


def _border(
    log: LaserLog, before: int, behind: int, value: float, is_begin: bool, options: FileCheckOptions
) -> tuple[int, int]:
    """Rows between which the logarithm of the scale becomes a value, or 0 again, more exactly."""
    if behind <= before:
        return min(before, behind), max(before, behind)
    first, last = possible_steps(log, options.steps)
    tried, told_by = 0, options.stretches
    for _ in range(told_by.bisections):
        within = np.flatnonzero((first >= before) & (last <= behind))
        if tried == len(PLACES) or len(within) < 2:
            break
        # A single match may fail.
        middle, apart = int(PLACES[tried] * len(within)), max(len(within) // 16, 1)
        places = middle + apart * np.arange(-2, 3)
        some = within[np.unique(np.clip(places, 0, len(within) - 1))]
        measured = _measured(log, np.array([first[some], last[some]]), options)
        steps, values = _told(log, measured, told_by)
        sides = _is_nearer(values, value)
        is_clear = _is_clear(values, 0.0, value, told_by) | _is_clear(values, value, value, told_by)
        if np.count_nonzero(is_clear) < 2 or len(set(sides[is_clear].tolist())) > 1:
            # The robot stands there, or no scans match, or it begins there.
            tried += 1
            continue
        tried = 0
        if bool(sides[is_clear][0]) == is_begin:
            behind = int(steps.first[is_clear].min())
        else:
            before = int(steps.last[is_clear].max())
        if behind <= before:
            break
    return min(before, behind), max(behind, before)
