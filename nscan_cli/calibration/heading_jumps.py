"""Headings by odometry that jump, and positions that go on as before: a gyro that was set to zero.

Scans show no turn there, and from there on the robot seems to drive another way in its own frame than before.
A laser that is turned on the robot makes scans jump instead. Where all of odometry begins anew, its positions
turn with the headings.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from nscan_cli.calibration.changed_odometry import with_changed_odometry
from nscan_cli.calibration.findings import UNDONE
from nscan_cli.calibration.measured_steps import KnownSteps, measure_steps
from nscan_cli.calibration.odometry_fault_options import HeadingJumpOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.scan_turns import scan_turns
from nscan_cli.files.text import shortened_list
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, are_known, relative, wrap


def checked_heading_jumps(
    log: LaserLog, options: FileCheckOptions, known: KnownSteps
) -> tuple[LaserLog, list[str]]:
    """The log with its headings turned back behind each jump, and messages.

    Scans are matched only at jumps that positions show; what they measure is added to `known`.
    """
    said: list[str] = []
    if log.odometry is None:
        return log, said
    times, poses = log.known_odometry()
    for row in heading_jumps(poses, options.heading_jumps):
        first = int(np.searchsorted(log.times, times[row - 1], side="right")) - 1
        last = int(np.searchsorted(log.times, times[row]))
        turns = _turns_across(log, first, last, options, known)
        if turns is None:
            continue
        turn, turned = turns
        jump = float(wrap(turned - turn))
        if abs(turn) > options.heading_jumps.max_turn * abs(jump):
            continue
        log = with_changed_odometry(log, partial(_turned_back, begin=float(times[row]), jump=jump))
        said.append(f"by {np.degrees(jump):+.0f}° at scan {log.numbers[last]}")
    if not said:
        return log, said
    message = (
        f"headings by odometry jump {shortened_list(said)}, where the scans do not turn and positions go on "
        f"as before: they are turned back from there on; {UNDONE}"
    )
    return log, [message]


def _turns_across(
    log: LaserLog, first: int, last: int, options: FileCheckOptions, known: KnownSteps
) -> tuple[float, float] | None:
    """The turn by scans and that by odometry, rad, from a row to another, or from or to one beside them.

    Where scans measure no such step, as along bare walls that leave the way open, the turn by scans is a
    rough one. None where odometry is missing.
    """
    assert log.odometry is not None
    is_known = are_known(log.odometry)
    pairs = ((first - before, last + behind) for before in (0, 1) for behind in (0, 1))
    steps = [(np.array([begin]), np.array([end])) for begin, end in pairs if begin >= 0 and end < len(log)]
    steps = [step for step in steps if is_known[np.concatenate(step)].all()]
    for step in steps:
        found = measure_steps(log, step, options.steps, known=known)
        if len(found):
            return float(found.laser[0, 2]), float(found.odometry(log.odometry)[0, 2])
    if not steps:
        return None
    seen = scan_turns(log, *steps[0], options.held.scan_turns)
    turned = relative(log.odometry[steps[0][1]], log.odometry[steps[0][0]])[0, 2]
    return float(seen[0]), float(turned)


def heading_jumps(poses: Array, options: HeadingJumpOptions) -> list[int]:
    """The rows to which headings of poses (P, 3) jump, and positions do not turn with them, in order.

    There the robot goes on another way in its own frame.
    """
    steps = relative(poses[1:], poses[:-1])
    turns = np.abs(steps[:, 2])
    found = np.flatnonzero(turns >= options.min_jump)
    largest = np.sort(found[np.argsort(-turns[found], kind="stable")[: options.max_jumps]])
    moving = np.flatnonzero(np.hypot(steps[:, 0], steps[:, 1]) >= options.min_driven)
    ways = np.arctan2(steps[moving, 1], steps[moving, 0])
    rows = []
    for step in largest.tolist():
        before, behind = np.searchsorted(moving, [step, step + 1])
        sides = ways[max(before - options.most_steps, 0) : before], ways[behind : behind + options.most_steps]
        if min(map(len, sides)) >= options.min_steps and _turn_against(*sides, steps[step, 2], options):
            rows.append(step + 1)
    return rows


def _turn_against(before: Array, behind: Array, jump: float, options: HeadingJumpOptions) -> bool:
    """Whether the ways (n,) that a robot drives in its own frame turn against a jump of its heading, rad.

    A robot that drives to and fro has no such way, but one but for its sign.
    """
    for times in (1, 2):
        means = [np.exp(1j * times * each).mean() for each in (before, behind)]
        if min(map(abs, means)) >= options.min_agreement:
            turned = float(np.angle(means[1] / means[0]))
            apart, jumped = (abs(float(wrap(angle))) for angle in (turned + times * jump, times * jump))
            return apart <= options.tolerance * times * abs(jump) < jumped
    return False


def _turned_back(poses: Array, times: Array, begin: float, jump: float) -> Array:
    """Poses (P, 3) at times (P,) with the headings of those from `begin` (s) on turned back by a jump."""
    found = poses.copy()
    behind = times >= begin
    found[behind, 2] = wrap(found[behind, 2] - jump)
    return found
