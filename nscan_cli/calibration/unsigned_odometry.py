"""Odometry that counts reversing as driving forward: its encoders do not tell which way the wheels turn."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.calibration.changed_odometry import with_scaled_steps
from nscan_cli.calibration.measured_steps import measure_steps
from nscan_cli.calibration.odometry_options import UnsignedOdometryOptions
from nscan_cli.calibration.step_options import StepOptions
from nscan_cli.kernels.decorators import kernel
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.mask_runs import mask_runs, stretch_names
from nscan_cli.poses import Array, Indices, are_known, compose, relative

REVERSED = np.array([-1.0, -1.0, 1.0])
"""Factors of a step if the wheels turned the other way: its turn is known from their difference."""


class ReversedStretch(NamedTuple):
    """A stretch over which the robot drives the other way than odometry says."""

    first: Indices
    """(n,) rows where steps in it begin."""
    last: Indices
    """(n,) rows where they end."""
    begin: float
    """Time when the robot changes its direction, s."""
    end: float


def checked_signs(
    log: LaserLog, options: UnsignedOdometryOptions, steps: StepOptions
) -> tuple[LaserLog, list[str]]:
    """The log with its odometry reversed where the robot drives the other way, and messages."""
    found = reversed_stretches(log, options)
    votes = [_votes(log, each, options, steps) for each in found]
    long = [len(each.first) >= options.min_steps for each in found]
    if not any(is_long and vote > 0 for is_long, vote in zip(long, votes, strict=True)):
        return log, []
    # Once scans have shown one, ranges alone tell of long ones where no scans match.
    stretches = [
        each
        for each, is_long, vote in zip(found, long, votes, strict=True)
        if vote > 0 or (is_long and vote == 0)
    ]
    names = stretch_names((log.numbers[each.first[0]], log.numbers[each.last[-1]]) for each in stretches)
    message = (
        "odometry counts reversing as driving forward: the scans show the robot going the other way from "
        f"scan {names}; odometry is reversed there; --as-recorded uses it as it is"
    )
    return with_scaled_steps(log, [(each.begin, each.end) for each in stretches], -1.0), [message]


def reversed_stretches(log: LaserLog, options: UnsignedOdometryOptions) -> list[ReversedStretch]:
    """The stretches over which the ranges change as if the robot drove the other way than odometry says.

    There are none if odometry itself goes both ways, or if the ranges say so of most of the drive: then the
    file has the laser or the odometry the wrong way round.
    """
    if log.odometry is None or len(log) < 2 or not _goes_one_way(log.odometry, options):
        return []
    first, last = _step_rows(log, options)
    few = replace(options, max_beams=options.first_beams, min_beams=options.min_first_beams)
    errors = _errors(log, first, last, few)
    if np.count_nonzero(errors[:, 1] < options.first_error_ratio * errors[:, 0]) < options.min_steps:
        return []
    errors, clear = _errors(log, first, last, options), np.full(len(first), False)
    np.less(errors.min(axis=1), options.max_error_ratio * errors.max(axis=1), out=clear)
    first, last, backs = first[clear], last[clear], errors[clear, 1] < errors[clear, 0]
    if 2 * np.count_nonzero(backs) >= len(backs):
        return []
    # A direction lasts until the next clear step that has the other one.
    found = []
    for begin, end in mask_runs(backs):
        way = np.hypot(*(log.odometry[last[begin:end], :2] - log.odometry[first[begin:end], :2]).T)
        speed = float((way / (log.times[last[begin:end]] - log.times[first[begin:end]])).max())
        stops = log.times[[0, -1]].tolist()
        for side, at in enumerate((begin - 1, end - 1)):
            if 0 <= at < len(first) - 1:
                rows = [(int(first[row]), int(last[row])) for row in (at, at + 1)]
                stops[side], slowest = _change(log, *rows)
                if slowest > options.max_stop_speed * speed:
                    break
        else:
            found.append(ReversedStretch(first[begin:end], last[begin:end], *stops))
    return found


def _errors(log: LaserLog, first: Indices, last: Indices, options: UnsignedOdometryOptions) -> Array:
    """(n, 2) mean differences, m, of the ranges of the last scans to what the first ones predict, if the
    robot moves by odometry, and if it drives the other way; inf for few."""
    assert log.odometry is not None
    step = relative(log.odometry[last], log.odometry[first])
    errors = [
        _range_errors(
            log.ranges, log.angle_min, log.angle_increment, first, last, _of_laser(robot, log.mount),
            max(log.ranges.shape[1] // options.max_beams, 1), options.min_beams, options.max_error,
        )
        for robot in (step, step * REVERSED)
    ]  # fmt: skip
    return np.stack(errors, axis=1)


def _goes_one_way(odometry: Array, options: UnsignedOdometryOptions) -> bool:
    ahead = np.nan_to_num(relative(odometry[1:], odometry[:-1])[:, 0])
    forward, backward = float(ahead[ahead > 0.0].sum()), -float(ahead[ahead < 0.0].sum())
    least, most = sorted((forward, backward))
    return most > 0.0 and least <= options.max_backward_share * most


def _step_rows(log: LaserLog, options: UnsignedOdometryOptions) -> tuple[Indices, Indices]:
    """Rows (n,) between which odometry drives far enough for the ranges to tell its direction."""
    assert log.odometry is not None
    steps = np.nan_to_num(relative(log.odometry[1:], log.odometry[:-1]))
    way = np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])
    ends = np.flatnonzero(np.diff(np.floor(way / options.step_length), prepend=-1.0) > 0.0)
    first, last = ends[:-1], ends[1:]
    seconds = log.times[last] - log.times[first]
    kept = (seconds > 0.0) & (seconds <= options.max_duration)
    kept &= are_known(log.odometry[first]) & are_known(log.odometry[last])
    return first[kept], last[kept]


def _change(log: LaserLog, before: tuple[int, int], after: tuple[int, int]) -> tuple[float, float]:
    """The time (s) when the robot changes its direction from one step to a later one, given by their rows,
    and its least speed (m/s) over both.

    It changes where it is slowest by odometry, between the middles of the two steps.
    """
    assert log.odometry is not None
    times, poses = log.times[before[0] : after[1] + 1], log.odometry[before[0] : after[1] + 1]
    if log.odometry_path is not None:
        inside = slice(*np.searchsorted(log.odometry_path.times, times[[0, -1]]).tolist())
        if inside.stop - inside.start > len(times):
            times, poses = log.odometry_path.times[inside], log.odometry_path.poses[inside]
    lengths = np.nan_to_num(np.hypot(*np.diff(poses[:, :2], axis=0).T))
    periods, speeds = np.diff(times), np.full(len(lengths), np.inf)
    np.divide(lengths, periods, out=speeds, where=periods > 0.0)
    middles, ways = 0.5 * (times[1:] + times[:-1]), np.cumsum(lengths)
    ends = np.interp(log.times[[before[1], after[0]]], times[1:], ways)
    halfway = ways - 0.5 * lengths
    between = np.flatnonzero((halfway > 0.5 * ends[0]) & (halfway < 0.5 * (ends[1] + ways[-1])))
    at = middles[between[np.argmin(speeds[between])]] if len(between) else log.times[after[0]]
    return float(at), float(speeds.min())


def _votes(
    log: LaserLog, stretch: ReversedStretch, options: UnsignedOdometryOptions, steps: StepOptions
) -> int:
    """How many more steps of a stretch, matched without odometry, say that it is reversed than do not."""
    assert log.odometry is not None
    some = np.unique(np.linspace(0, len(stretch.first) - 1, options.measured_steps).astype(np.int64))
    found = measure_steps(log, (stretch.first[some], stretch.last[some]), steps)
    said = found.odometry(log.odometry)
    apart = [
        np.hypot(*(_of_laser(robot, log.mount) - found.laser)[:, :2].T) for robot in (said, said * REVERSED)
    ]
    return 2 * int((apart[1] < options.max_error_ratio * apart[0]).sum()) - len(found)


def _of_laser(steps: Array, mount: Array) -> Array:
    """(n, 3) the steps of a laser on a robot that makes these steps (n, 3)."""
    return relative(compose(steps, mount), mount)


@kernel
def _range_errors(
    ranges: NDArray[np.float32],
    angle_min: Array,
    angle_increment: Array,
    first: Indices,
    last: Indices,
    motions: Array,
    every: int,
    min_beams: int,
    max_error: float,
) -> Array:
    """(n,) mean difference, m, of the ranges of the last scans to what the first ones predict; inf for few.

    The laser moves by motions (n, 3) meanwhile. A difference counts as `max_error` at most.
    """
    errors = np.full(len(first), np.inf)
    directions, begin, between = np.empty((ranges.shape[1], 2)), np.nan, np.nan
    for k in range(len(first)):
        i, j, motion = first[k], last[k], motions[k]
        if angle_min[i] != begin or angle_increment[i] != between:
            # Nearly all scans of a log have the same directions.
            begin, between = angle_min[i], angle_increment[i]
            for beam in range(0, ranges.shape[1], every):
                angle = begin + beam * between
                directions[beam, 0], directions[beam, 1] = np.cos(angle), np.sin(angle)
        c, s = np.cos(motion[2]), np.sin(motion[2])
        around = round(2 * np.pi / abs(angle_increment[j]))
        total, count = 0.0, 0
        for beam in range(0, ranges.shape[1], every):
            if not np.isfinite(ranges[i, beam]):
                continue
            length = np.float64(ranges[i, beam])
            dx, dy = length * directions[beam, 0] - motion[0], length * directions[beam, 1] - motion[1]
            x, y = c * dx + s * dy, c * dy - s * dx
            at = round((np.arctan2(y, x) - angle_min[j]) / angle_increment[j]) % around
            if at < ranges.shape[1] and np.isfinite(ranges[j, at]):
                total += min(abs(np.sqrt(x * x + y * y) - ranges[j, at]), max_error)
                count += 1
        if count >= min_beams:
            errors[k] = total / count
    return errors
