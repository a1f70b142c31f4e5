"""The path between the middles of two sweeps of the laser, where the robot moves unevenly.

The poses at the middles of the sweeps are known. If the robot begins to turn between two of them, steady
motion from one to the next is off by some degrees there, and so is odometry with one pose a sweep. The beams
tell more: each part of a sweep is matched with the scans before and after. A change of motion moves the
points of all parts of a run of such scans. So these are matched at once, with the path between them.
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
from nscan_cli.slam.backend.uneven_path_match import TimedPoints, match_uneven_path
from nscan_cli.slam.options import SlamOptions


def path_of_sweeps(
    log: LaserLog, poses: Array, breaks: Sequence[int], options: SlamOptions
) -> RobotPath | None:
    """The path through poses (S, 3) at the middles of the sweeps, matched more finely where motion is uneven.

    The scans of `log` are stamped at the middles; the track broke before those in rows `breaks`. Where
    odometry tells the motion within a sweep, it is believed. None of fewer than two scans.
    """
    path, uneven = log.moving_along(poses).path, options.uneven_motion
    if path is None or _is_fine(log, uneven):
        return path
    parts, thinned = uneven.parts, with_some_beams(log, max(log.ranges.shape[1] // uneven.max_beams, 1))
    moving, still = replace(thinned, path=path), replace(thinned, path=None)
    times = _times_of_knots(log.times, parts)
    knots, is_known = poses_at(path, times), np.arange(len(times)) % parts == 0
    knots[is_known] = poses
    outside, steps = ~np.isin(path.times, log.times), _known_steps(log.times, breaks, uneven)
    for first, last in _runs(_is_uneven(log.times, poses, steps, uneven), uneven.longest_run):
        # A scan more on each side: at the ends of what is matched nothing tells the motion beyond.
        before, after = first > 1 and steps[first - 2], last < len(steps) and steps[last]
        run = _Run(moving, still, times, knots, (first - 1 - int(before), last + int(after)), options)
        if run.match():
            inside = slice(parts * (first - 1), parts * last + 1)
            knots[inside], is_known[inside] = run.found(inside), True
            outside &= (path.times < times[inside.start]) | (path.times > times[inside.stop - 1])
    all_times = np.concatenate([times[is_known], path.times[outside]])
    order = np.argsort(all_times, kind="stable")
    return robot_path(all_times[order], np.concatenate([knots[is_known], path.poses[outside]])[order])


def _times_of_knots(times: Array, parts: int) -> Array:
    """Times (S,), s, and those that divide the time from each to the next into `parts`."""
    between = times[:-1, None] + np.arange(parts) / parts * np.diff(times)[:, None]
    return np.append(between.ravel(), times[-1])


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
    """Scans in uneven motion, and those on both sides that they are matched with."""

    def __init__(
        self,
        moving: LaserLog,
        still: LaserLog,
        times: Array,
        knots: Array,
        rows: tuple[int, int],
        options: SlamOptions,
    ) -> None:
        """Find the path from the first to the last of `rows`, which is through `knots` (n, 3) so far.

        They are those of all scans, at `times` (n,), s. `moving` are the scans, with the path before any run
        was matched, `still` the same without a path.
        """
        self._moving, self._still, self._rows, self._options = moving, still, rows, options
        (first, last), uneven = rows, options.uneven_motion
        around = slice(uneven.parts * first, uneven.parts * last + 1)
        self._start, self._times, self._all_knots = around.start, times[around], knots
        self._knots = knots[around].copy()
        # It takes longer than all else here, and hardly any path turns past π.
        if np.abs(np.diff(self._knots[:, 2])).max() >= np.pi:
            self._knots[:, 2] = np.unwrap(self._knots[:, 2])
        self._near = slice(max(first - uneven.scans, 0), last + 1 + uneven.scans)

    def found(self, knots: slice) -> Array:
        """The poses of `knots`, which are among those of the path that is found."""
        found = self._knots[knots.start - self._start : knots.stop - self._start].copy()
        found[:, 2] = wrap(found[:, 2])
        return found

    def match(self) -> bool:
        """Find the path on which the beams fit best; whether they tell it."""
        uneven, start = self._options.uneven_motion, self._knots
        seen, sweeps = self._seen(), len(start) / uneven.parts
        beside = len(self._moving.times[self._near]) - (self._rows[1] + 1 - self._rows[0])
        if beside < uneven.scans or len(seen.points) < uneven.min_points * sweeps:
            return False
        self._knots, gain = match_uneven_path(self._reference(), seen, self._times, start, uneven)
        off = np.abs(self._knots - start)[:: uneven.parts]
        near = (off < uneven.max_sigmas * np.array([uneven.sigma, uneven.sigma, uneven.turn_sigma])).all()
        return bool(near) and gain > uneven.min_gain * (len(start) - 1)

    def _reference(self) -> Ndt:
        """The Gaussians of the scans on both sides."""
        gaussians, reach = self._options.nscan.gaussians, self._options.tracking.max_range
        points, ends = self._moving.batch_points(self._near, reach)
        first, end = (row - self._near.start for row in (self._rows[0], self._rows[1] + 1))
        poses = self._all_knots[:: self._options.uneven_motion.parts][self._near]
        points = np.concatenate([points[: ends[first]], points[ends[end] :]])
        ends = np.concatenate([ends[:first], ends[end:] - (ends[end] - ends[first])])
        poses = np.concatenate([poses[:first], poses[end:]])
        return Ndt.of_scans(points, ends, poses, gaussians, neighbourhood=WALL_DIRECTION)

    def _seen(self) -> TimedPoints:
        """The points of the scans in the time of the path, in order of time."""
        rows, reach = slice(self._rows[0], self._rows[1] + 1), self._options.tracking.max_range
        points, ends, times = self._still.timed_points(rows, reach)
        times += np.repeat(self._moving.times[rows], np.diff(ends))
        order = np.argsort(times, kind="stable")
        order = order[(times[order] >= self._times[0]) & (times[order] < self._times[-1])]
        return TimedPoints(points[order], times[order])
