"""Readings that come in the other order from a scan on: scans before and behind show it, with no turn at all.

A scan that is read in the wrong order is the mirror image of what it would be. Beside the place scans match
mirror images of each other better than themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from nscan_cli.calibration.compared_ranges import ComparedRanges
from nscan_cli.calibration.measured_steps import measure_steps
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.range_jumps import lead_one_way, pairs_across, scans_to_match
from nscan_cli.calibration.step_sampling import telling_steps
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.mask_runs import mask_runs, stretch_names
from nscan_cli.matching.scan_pairs import ScanPair, match_scans
from nscan_cli.poses import MIRRORED, Mask


def checked_order(
    log: LaserLog, compared: ComparedRanges, options: FileCheckOptions
) -> tuple[LaserLog, list[str]]:
    """The log with all of its readings in one order, and the messages. `compared` are its scans.

    That is the order with which odometry turns as the scans do; without it, that of most scans.
    """
    rows = order_jumps(log, compared, options)
    if not rows:
        return log, []
    is_other: Mask = np.zeros(len(log), dtype=np.bool_)
    for row in rows:
        is_other[row:] = ~is_other[row:]
    votes = _turn_votes(log, is_other, options) or len(log) - 2 * np.count_nonzero(is_other)
    if votes < 0:
        is_other = ~is_other
    names = stretch_names(log.numbers[[first, end - 1]].tolist() for first, end in mask_runs(is_other))
    message = (
        f"the readings of scans {names} come in the other order than those of the others, whose "
        "mirror images they match: they are read in the order of the others; --as-recorded reads them as "
        "they are"
    )
    first, between = log.angle_min.copy(), log.angle_increment.copy()
    first[is_other] *= -1.0
    between[is_other] *= -1.0
    return replace(log, angle_min=first, angle_increment=between), [message]


def _turn_votes(log: LaserLog, is_other: Mask, options: FileCheckOptions) -> int:
    """How many more turns by odometry agree with the scans if the scans in `is_other` (S,) are mirrored than
    if the others are; 0 without odometry."""
    if log.odometry is None:
        return 0
    found = measure_steps(log, telling_steps(log, options.steps), options.steps, turns_alone=True)
    laser, odometry = found.laser[:, 2], found.odometry(log.odometry)[:, 2]
    told = (np.abs(laser) >= options.view.min_turn) & (is_other[found.first] == is_other[found.last])
    agree = np.sign(laser * np.nan_to_num(odometry)) * np.where(is_other[found.first], -1.0, 1.0)
    return int(agree[told].sum())


def order_jumps(log: LaserLog, compared: ComparedRanges, options: FileCheckOptions) -> list[int]:
    """The rows from which on the readings come in the other order than before."""
    if len(log) < 4:
        return []
    order, gains = options.order, compared.mirror_gains
    # Two scans before each place and two behind are matched.
    places = np.flatnonzero(gains[1:-1] >= order.min_share_gain) + 1
    best = places[np.argsort(-gains[places], kind="stable")[: order.max_candidates]]
    return [row for row in (np.sort(best) + 1).tolist() if _changes_at(log, row, options)]


def _changes_at(log: LaserLog, row: int, options: FileCheckOptions) -> bool:
    """Whether scans before a row match the mirror images of those behind, and those of one side do not.

    As read after any turn they match no better: the laser may have been turned on the robot.
    """
    gain, across = options.order.min_gain, []
    for rows in pairs_across(row):
        matched = _matched_both_ways(log, *rows, options)
        if matched is None or _gain(matched) <= gain:
            return False
        across.append(matched)
    sides = []
    for first in (row - 2, row):
        matched = _matched_both_ways(log, first, first + 1, options)
        if matched is None or _gain(matched) >= -gain:
            return False
        sides.append(matched.as_read.pose)
    if _match_after_turns(log, row, across, options):
        return False
    if log.odometry is not None:
        return True
    # Nothing tells how far the robot turned from one scan to the next: as read they may match after a turn.
    order = options.order
    turns = np.arange(-order.largest_turn, order.largest_turn + 0.5 * order.turn_step, order.turn_step)
    turned = (_matched_both_ways(log, *rows, options, turns.tolist()) for rows in pairs_across(row))
    # Two scans of a long room from before and after a turn may fit the mirror image better.
    before, behind = sides[0], sides[1] * MIRRORED
    return lead_one_way(
        [matched.mirrored.pose for matched in across],
        (before, behind),
        order.max_misfit,
        order.max_turn_misfit,
    ) and all(matched is not None and _gain(matched) > gain for matched in turned)


def _match_after_turns(
    log: LaserLog, row: int, across: Sequence[_Matched], options: FileCheckOptions
) -> bool:
    """Whether pairs across a row match better as read, after some turn, than with the later one mirrored."""
    turns = np.arange(-np.pi, np.pi, options.order.turn_step).tolist()
    gain = 0.0
    for mirrored, rows in zip(across, pairs_across(row), strict=True):
        turned = _matched_both_ways(log, *rows, options, turns)
        if turned is not None:
            gain += (mirrored.mirrored.energy - turned.as_read.energy) / turned.points
    return gain > options.order.min_gain * len(across)


class _Matched(NamedTuple):
    as_read: ScanPair
    mirrored: ScanPair
    points: int


def _gain(matched: _Matched) -> float:
    """By how much the energy per point is lower with the later scan mirrored."""
    return (matched.as_read.energy - matched.mirrored.energy) / matched.points


def _matched_both_ways(
    log: LaserLog, first: int, last: int, options: FileCheckOptions, turns: Sequence[float] = (0.0,)
) -> _Matched | None:
    """The matches of two scans, from where odometry leads or after one of these `turns` (rad); None for too
    few points."""
    pair_of_scans = scans_to_match(log, first, last, options)
    if pair_of_scans is None:
        return None
    before, behind, start = pair_of_scans
    # Odometry itself may turn the wrong way.
    starts = [start, *(np.array([0.0, 0.0, turn]) for turn in turns)]
    as_read, mirrored = (
        min(
            (match_scans(before, points, each, options.steps.pair) for each in starts),
            key=attrgetter("energy"),
        )
        for points in (behind, behind * (1.0, -1.0))
    )
    return _Matched(as_read, mirrored, len(behind))
