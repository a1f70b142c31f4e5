"""The path between the middles of two turns of the laser, where the robot moves unevenly.

The poses at the middles of the turns are known. If the robot begins to turn between two of them, steady
motion from one to the next is off by some degrees there, and so is odometry with one pose a turn. The beams
tell more: each part of a turn is matched with the scans before and after. A change of motion moves the points
of all parts of a run of such scans. So these are matched at once, with the path between them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.log_excerpt import with_some_beams
from nscan_cli.logs.mask_runs import mask_runs
from nscan_cli.logs.robot_path import RobotPath, RobotPathOptions, poses_at, robot_path
from nscan_cli.ndt.hash_grid import WALL_DIRECTION
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, Mask, relative, wrap
from nscan_cli.slam.backend.options import UnevenMotionOptions
from nscan_cli.slam.backend.turn_energy import FIT, TimedPoints, TurnEnergy
from nscan_cli.slam.options import SlamOptions


def path_of_turns(
    log: LaserLog, poses: Array, breaks: Sequence[int], options: SlamOptions
) -> RobotPath | None:
    """The path through poses (S, 3) at the middles of the turns, matched more finely where motion is uneven.

    The scans of `log` are stamped at the middles; the track broke before those in rows `breaks`. Where
    odometry tells the motion within a turn, it is believed. None of fewer than two scans.
    """
    path, uneven = log.moving_along(poses).path, options.uneven_motion
    if path is None or _is_fine(log, uneven):
        return path
    poses, times, found = poses.copy(), [log.times], list[Array]()
    outside = ~np.isin(path.times, log.times)
    thinned = with_some_beams(log, max(log.ranges.shape[1] // uneven.max_beams, 1))
    known = _known_steps(log.times, breaks, uneven)
    for first, last in _runs(_is_uneven(log.times, poses, known, uneven), uneven.longest_run):
        # A scan more on each side: at the ends of what is matched nothing tells the motion beyond.
        before, after = first > 1 and known[first - 2], last < len(known) and known[last]
        around = first - 1 - int(before), last + int(after)
        run = _Run(thinned, poses, path, (first - 1, last), around, options)
        if run.match():
            poses[run.rows] = run.knots[run.is_middle]
            times.append(run.times[~run.is_middle])
            found.append(run.knots[~run.is_middle])
            outside &= (path.times < run.times[0]) | (path.times > run.times[-1])
    all_times = np.concatenate([*times, path.times[outside]])
    order = np.argsort(all_times, kind="stable")
    return robot_path(all_times[order], np.concatenate([poses, *found, path.poses[outside]])[order])


def _is_fine(log: LaserLog, options: UnevenMotionOptions) -> bool:
    """Whether odometry has several poses in the time from one scan to the next."""
    if log.odometry is None or log.odometry_path is None or len(log) < 2:
        return False
    period = float(np.median(np.diff(log.times)))
    return float(np.median(np.diff(log.odometry_path.times))) < options.odometry_periods * period


def _known_steps(times: Array, breaks: Sequence[int], options: UnevenMotionOptions) -> Mask:
    """(S − 1,) whether it is known how the robot came from each scan to the next."""
    seconds = np.diff(times)
    usual = float(np.median(seconds)) if len(seconds) else 0.0
    longest = min(RobotPathOptions.longest_step, options.longest_step * usual)
    known: Mask = (seconds > 0.0) & (seconds < longest)
    known[np.array(breaks, dtype=np.int64) - 1] = False
    return known


def _is_uneven(times: Array, poses: Array, known: Mask, options: UnevenMotionOptions) -> Mask:
    """(S,) whether the motion from the scan before differs from that before it, or from the next one.

    `known` (S − 1,) are the steps that are.
    """
    seconds = np.where(known, np.diff(times), 1.0)
    steps = relative(poses[1:], poses[:-1]) * (np.median(seconds) / seconds)[:, None]
    change = np.abs(np.diff(steps, axis=0))
    moves = np.hypot(change[:, 0], change[:, 1]) > options.min_change
    changes = (moves | (change[:, 2] > options.min_turn_change)) & known[1:] & known[:-1]
    is_uneven = np.zeros(len(times), dtype=np.bool_)
    is_uneven[1:-1] |= changes
    is_uneven[2:] |= changes
    return is_uneven


def _runs(marks: Mask, longest: int) -> Iterator[tuple[int, int]]:
    """First and last row of each run of marks (S,), cut into parts of at most `longest` rows."""
    for first, end in mask_runs(marks):
        for begin in range(first, end, longest):
            yield begin, min(begin + longest, end) - 1


class _Run:
    """Scans in uneven motion, and those about them that they are matched with."""

    def __init__(
        self,
        log: LaserLog,
        poses: Array,
        path: RobotPath,
        rows: tuple[int, int],
        around: tuple[int, int],
        options: SlamOptions,
    ) -> None:
        """Find the path between the first and last of `rows`, by matching those from the first to the last
        `around` them. `poses` (S, 3) are those of all scans, `path` is theirs before any run was matched."""
        self._log, self._options, self._around = log, options, around
        uneven, parts, (first, last) = options.uneven_motion, options.uneven_motion.parts, around
        self.rows = slice(rows[0], rows[1] + 1)
        middles = log.times[first : last + 1]
        between = middles[:-1, None] + np.arange(parts) / parts * np.diff(middles)[:, None]
        self._times = np.append(between.ravel(), middles[-1])
        self._knots = poses_at(path, self._times)
        self._knots[::parts] = poses[first : last + 1]
        self._knots[:, 2] = np.unwrap(self._knots[:, 2])
        near = np.arange(max(first - uneven.scans, 0), min(last + 1 + uneven.scans, len(log)))
        self._sides = near[near < first], near[near > last]
        self._moving = replace(log, path=robot_path(log.times[near], poses[near]))
        self._inside = slice(parts * (rows[0] - first), parts * (rows[1] - first) + 1)

    @property
    def times(self) -> Array:
        """(n,) times of the knots of the path that is found, s."""
        return self._times[self._inside]

    @property
    def knots(self) -> Array:
        """(n, 3) poses of the knots."""
        found = self._knots[self._inside].copy()
        found[:, 2] = wrap(found[:, 2])
        return found

    @property
    def is_middle(self) -> Mask:
        """(n,) whether they are at the middles of turns."""
        middles: Mask = np.arange(len(self.times)) % self._options.uneven_motion.parts == 0
        return middles

    def match(self) -> bool:
        """Find the path on which the beams fit best; whether they tell it."""
        uneven, start = self._options.uneven_motion, self._knots
        seen, turns = self._seen(), len(start) / uneven.parts
        if sum(map(len, self._sides)) < uneven.scans or len(seen.points) < uneven.min_points * turns:
            return False
        energy = TurnEnergy(self._reference(), seen, self._times, start, uneven)
        _, before = energy.least(start, uneven.widenings[-1], uneven.tolerance, 0)
        for widening in uneven.widenings:
            enough = uneven.tolerance if widening == uneven.widenings[-1] else uneven.coarse_tolerance
            self._knots, after = energy.least(self._knots, widening, enough, uneven.iterations)
        off = np.abs(self._knots - start)[:: uneven.parts]
        near = (off < uneven.max_sigmas * np.array([uneven.sigma, uneven.sigma, uneven.turn_sigma])).all()
        gain = before.terms[FIT] - after.terms[FIT]
        return bool(near) and gain > uneven.min_gain * (len(start) - 1)

    def _reference(self) -> Ndt:
        """The Gaussians of the scans on both sides."""
        gaussians, reach = self._options.nscan.gaussians, self._options.tracking.max_range
        sides = [
            self._moving.batch_points(slice(rows[0], rows[-1] + 1), reach)
            for rows in self._sides
            if len(rows)
        ]
        points = np.concatenate([seen for seen, _ in sides])
        ends = np.append(0, np.cumsum(np.concatenate([np.diff(ends) for _, ends in sides])))
        assert self._moving.path is not None
        poses = poses_at(self._moving.path, self._log.times[np.concatenate(self._sides)])
        return Ndt.of_scans(points, ends, poses, gaussians, neighbourhood=WALL_DIRECTION)

    def _seen(self) -> TimedPoints:
        """The points of the scans in the time of the path, in order of time."""
        rows, reach = slice(self._around[0], self._around[1] + 1), self._options.tracking.max_range
        points, ends, times = replace(self._log, path=None).timed_points(rows, reach)
        times += np.repeat(self._log.times[rows], np.diff(ends))
        order = np.argsort(times, kind="stable")
        order = order[(times[order] >= self._times[0]) & (times[order] < self._times[-1])]
        return TimedPoints(points[order], times[order])
