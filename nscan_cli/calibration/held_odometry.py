"""Stretches in which odometry stands while the scans move: a node hangs, or encoders have failed.

If encoders fail and a gyroscope goes on, the position alone stands; the other way round, the heading alone.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nscan_cli.calibration.driving_direction import driving_direction
from nscan_cli.calibration.measured_steps import measure_steps
from nscan_cli.calibration.odometry_options import HeldOdometryOptions
from nscan_cli.calibration.scan_turns import scan_turns
from nscan_cli.calibration.step_options import StepOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.mask_runs import mask_runs, stretch_names
from nscan_cli.logs.robot_parts import evenly
from nscan_cli.logs.robot_path import robot_path
from nscan_cli.poses import Array, Indices, relative, wrap


def checked_held(
    log: LaserLog, options: HeldOdometryOptions, steps: StepOptions
) -> tuple[LaserLog, list[str]]:
    """The log without its odometry where that stands and the scans move, and the messages."""
    held = held_stretches(log, options, steps)
    if not held:
        return log, []
    names = stretch_names((log.numbers[first], log.numbers[last]) for first, last in held)
    message = (
        f"odometry stands still while the scans move, from scan {names}: it is not used "
        "there, and steady motion takes its place; --as-recorded uses it as it is"
    )
    return without_held(log, held, options), [message]


def held_stretches(log: LaserLog, options: HeldOdometryOptions, steps: StepOptions) -> list[tuple[int, int]]:
    """First and last row of each stretch over which the scans move and the position by odometry does not, or
    they turn and the heading does not.

    Odometry that never moves has none: it is of no use anywhere.
    """
    if log.odometry is None or len(log) < 2:
        return []
    moves = np.abs(relative(log.odometry[1:], log.odometry[:-1]))
    is_held = np.zeros(len(log), dtype=np.bool_)
    for change, least, scans_do in (
        (moves[:, :2].max(axis=1), options.min_duration, _scans_move),
        (moves[:, 2], options.min_heading_duration, _scans_turn),
    ):
        # An unknown pose neither stands nor moves: it ends a stretch.
        for first, last in mask_runs(change <= options.still):
            is_long = log.times[last] - log.times[first] >= least and last - first < len(log) - 1
            if is_long and scans_do(log, first, last, options, steps):
                is_held[first : last + 1] = True
    return [(first, end - 1) for first, end in mask_runs(is_held)]


def without_held(log: LaserLog, stretches: list[tuple[int, int]], options: HeldOdometryOptions) -> LaserLog:
    """The log without its odometry after the beginning of each stretch, up to its end.

    Behind it, the headings fit the positions again.
    """
    log = without_rows(log, stretches)
    if log.odometry is None:
        return log
    odometry = log.odometry.copy()
    _turn_headings(odometry, [last + 1 for _, last in stretches], options)
    path = None if log.odometry_path is None else robot_path(log.times, odometry)
    return replace(log, odometry=odometry, odometry_path=path)


def without_rows(log: LaserLog, stretches: Sequence[tuple[int, int]]) -> LaserLog:
    """The log without its odometry after the first row of each stretch, up to its last."""
    if log.odometry is None or not stretches:
        return log
    odometry = log.odometry.copy()
    for first, last in stretches:
        odometry[first + 1 : last + 1] = np.nan
    # What was recorded between the scans is wrong there as well.
    path = None if log.odometry_path is None else robot_path(log.times, odometry)
    return replace(log, odometry=odometry, odometry_path=path)


def _turn_headings(odometry: Array, begins: list[int], options: HeldOdometryOptions) -> None:
    """Turn the headings of odometry (S, 3) so that they fit the positions where it `begins` anew, at these
    rows.

    A heading that stood has lost the turns, but positions may have gone on. Robots drive the way that they
    head, or always some other way. Where they do not, nothing is changed.
    """
    for begin, end in itertools.pairwise([*begins, len(odometry)]):
        before, behind = (
            _usual_heading(odometry[rows], options) for rows in (slice(0, begin), slice(begin, end))
        )
        turn = float(wrap(behind - before))
        if abs(turn) > options.min_lost_turn:
            odometry[begin:, 2] += turn


def _usual_heading(odometry: Array, options: HeldOdometryOptions) -> float:
    """The way that the robot drives, in its own frame, rad; nan if there is no such one."""
    mean = driving_direction(odometry, options.min_driven, options.min_driven_steps)
    is_one = float(np.hypot(*mean)) >= options.min_agreement
    return float(np.arctan2(mean[1], mean[0])) if is_one else np.nan


def _scans_move(
    log: LaserLog, first: int, last: int, options: HeldOdometryOptions, steps: StepOptions
) -> bool:
    """Whether most of some steps, spread over a stretch, are of a robot that moves."""
    # To look at two scans costs next to nothing, and mostly the robot stands.
    both = log.ranges[[first, last]]
    apart = np.abs(np.diff(both[:, np.isfinite(both).all(axis=0)], axis=0))
    if not apart.size or float((apart > options.changed_range).mean()) < options.min_changed_share:
        return False
    assert log.odometry is not None
    # If headings go on, the robot may turn on the spot: then steps without a turn tell.
    turns = np.abs(np.diff(log.odometry[first : last + 1, 2])).max() > options.still
    for count in (options.steps, options.more_steps):
        laser = measure_steps(log, _rows_within(log, first, last, count, steps), steps).laser
        laser = laser[np.abs(laser[:, 2]) < steps.min_motion] if turns else laser
        if len(laser) < options.min_measured:
            continue
        size = np.maximum(np.hypot(laser[:, 0], laser[:, 1]), np.abs(laser[:, 2]))
        share = float((size >= steps.min_motion).mean())
        # Of a few steps some may be of a robot that stood just then.
        if not options.standing_share < share < options.min_moving_share:
            return share >= options.min_moving_share
    return False


def _scans_turn(
    log: LaserLog, first: int, last: int, options: HeldOdometryOptions, steps: StepOptions
) -> bool:
    """Whether a few of many steps, spread over a stretch, have a clear turn."""
    # A rough look costs next to nothing, and on long straight ways hardly a step has one.
    begins, ends = _rows_within(log, first, last, options.rough_steps, steps)
    turns = np.flatnonzero(np.abs(scan_turns(log, begins, ends, options.scan_turns)) >= options.min_turn)
    if len(turns) < options.min_measured:
        return False
    chosen = turns[evenly(len(turns), options.more_steps)]
    measured = measure_steps(log, (begins[chosen], ends[chosen]), steps, turns_alone=True).laser[:, 2]
    return bool(np.count_nonzero(np.abs(measured) >= options.min_turn) >= options.min_measured)


def _rows_within(
    log: LaserLog, first: int, last: int, count: int, steps: StepOptions
) -> tuple[Indices, Indices]:
    """The rows where up to `count` steps begin and end that are spread from a row to another."""
    ends = np.searchsorted(log.times, log.times[first : last + 1] + steps.duration)
    within = np.flatnonzero(ends <= last)
    some = within[evenly(len(within), count)]
    return first + some, ends[some]
