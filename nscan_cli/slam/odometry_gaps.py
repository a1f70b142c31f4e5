"""The way over gaps of the odometry along which scans do not show how far the robot went, by both sides.

Along bare walls tracking assumes steady motion while odometry is missing. It holds on to ripples of the
energy then, and the robot may seem to stop while its corridor goes by. But where odometry goes on behind the
gap, it tells how far the robot came meanwhile: the way that scans tell, and the rest, along which they tell
nothing. The robot is assumed to have driven the rest at one speed. If both sides then meet, that is taken for
the odometry of the gap, and the drive is mapped again. They do not meet if odometry began anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nscan_cli.calibration.driving_direction import driving_direction
from nscan_cli.files.text import shortened_list
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.mask_runs import mask_runs
from nscan_cli.logs.robot_path import robot_path
from nscan_cli.poses import Array, are_known, compose, relative, wrap
from nscan_cli.slam.backend.degenerate_relations import usual_speed
from nscan_cli.slam.options import BridgedGapOptions
from nscan_cli.slam.state import SlamState


class BridgedGap(NamedTuple):
    """A gap of the odometry, and the way over it."""

    first: int
    """Row of the first scan without odometry."""
    end: int
    """Row of the first scan with odometry behind it."""
    way: Array
    """(end − first + 1, 3) poses of these scans in the frame of the scan before."""
    path: float
    """Length of the way that scans do not tell, m."""
    mapped: float
    """Its length by the map, m."""


class _Gap(NamedTuple):
    """What is known of a gap with n − 1 scans."""

    way: Array
    """(n + 1, 3) poses by the map in the frame of the scan before the gap."""
    by_odometry: Array
    """(3,) pose of the scan behind it in that frame."""
    weak_periods: Array
    """(n,) the time of each step that scans do not tell, s; 0 for the others."""


def bridged_gaps(state: SlamState, poses: Array) -> list[BridgedGap]:
    """The gaps of the odometry whose way a finished map has too short or too long.

    The map has the scans at poses (S, 3). No gap with a break of the track or a jump of the odometry is
    bridged, and none of a robot that also drives backward or sideways.
    """
    log, options = state.log, state.options.odometry_gaps
    if log.odometry is None or (known := are_known(log.odometry)).all():
        return []
    usual = usual_speed(log.odometry, log.times, known, options.least_speed)
    ahead = driving_direction(log.odometry, options.least_speed * float(np.median(np.diff(log.times))), 1)
    if np.hypot(*ahead) < options.min_ahead:
        return []
    weak, found = np.concatenate(state.weakest_sigmas) > options.sigma, []
    broken = np.concatenate([state.breaks, state.odometry_jumps, state.odometry_stalls])
    for first, end in mask_runs(~known):
        is_inside = first > 0 and end < len(log)
        if is_inside and not ((first <= broken) & (broken <= end)).any():
            rows = slice(first - 1, end + 1)
            gap = _Gap(
                relative(poses[rows], poses[first - 1]),
                relative(log.odometry[end], log.odometry[first - 1]),
                np.diff(log.times[rows]) * weak[first : end + 1],
            )
            bridge = _bridge(gap, ahead, usual, options)
            found += [] if bridge is None else [BridgedGap(first, end, *bridge)]
    return found


def _bridge(
    gap: _Gap, ahead: Array, usual_speed: float, options: BridgedGapOptions
) -> tuple[Array, float, float] | None:
    """Poses, and both lengths, of a `BridgedGap`; None if the map has its way, or both sides do not meet.

    `ahead` (2,) is the way that the robot drives, in its own frame; speeds in m/s.
    """
    turned = float(wrap(gap.by_odometry[2] - gap.way[-1, 2]))
    if abs(turned) > options.max_turn:
        return None
    # A heading that is off by as much at the end is off by half of it on the way.
    target = compose([0.0, 0.0, -0.5 * turned], gap.by_odometry)[:2]
    steps, is_weak = np.diff(gap.way[:, :2], axis=0), gap.weak_periods > 0.0
    headings = gap.way[:-1, 2] + 0.5 * wrap(np.diff(gap.way[:, 2])) + np.arctan2(ahead[1], ahead[0])
    driven = np.stack([np.cos(headings), np.sin(headings)], axis=1) * gap.weak_periods[:, None]
    told = np.where(is_weak[:, None], 0.0, steps)
    along, rest = driven.sum(axis=0), target - told.sum(axis=0)
    speed = float(along @ rest) / max(float(along @ along), 1e-9)
    if not options.slowest * usual_speed <= speed <= options.fastest * usual_speed:
        return None
    path = speed * float(gap.weak_periods.sum())
    length = path + float(np.hypot(*told.T).sum())
    apart, gained = float(np.hypot(*(rest - speed * along))), float(np.hypot(*(target - gap.way[-1, :2])))
    if apart > options.max_apart + options.max_apart_share * length:
        return None
    if gained < options.least_gain + options.gain_for_apart * apart:
        return None
    way = np.column_stack([np.cumsum(told + speed * driven, axis=0), gap.way[1:, 2]])
    return way, path, float(np.hypot(*steps[is_weak].T).sum())


def with_bridged_gaps(log: LaserLog, gaps: Sequence[BridgedGap]) -> LaserLog:
    """The log with odometry in these gaps. Behind each, odometry goes on from the way over it."""
    if log.odometry is None:
        return log
    odometry, path = log.odometry.copy(), log.odometry_path
    for first, end, way, *_ in gaps:
        before, behind = odometry[first - 1], odometry[end].copy()
        over = compose(before, way)
        odometry[first:end] = over[:-1]
        odometry[end:] = compose(over[-1], relative(odometry[end:], behind))
        if path is not None:
            since = np.searchsorted(path.times, log.times[first - 1], side="right")
            until = np.searchsorted(path.times, log.times[end])
            moved = compose(over[-1], relative(path.poses[until:], behind))
            path = robot_path(
                np.concatenate([path.times[:since], log.times[first:end], path.times[until:]]),
                np.concatenate([path.poses[:since], over[:-1], moved]),
            )
    return replace(log, odometry=odometry, odometry_path=path)


def bridged_gaps_said(log: LaserLog, gaps: Sequence[BridgedGap]) -> list[str]:
    """What is said of gaps of a log's odometry that were bridged."""
    if not gaps:
        return []
    named = [
        f"{gap.path:.1f} m where scans alone have {gap.mapped:.1f} m from scan {log.numbers[gap.first - 1]} "
        f"to {log.numbers[gap.end]}"
        for gap in gaps
    ]
    return [
        "the walls do not show how far the robot went while odometry is missing, but its poses on both sides "
        f"do: {shortened_list(named)}; it is taken to have driven that steadily; --as-recorded leaves it to "
        "the scans"
    ]
