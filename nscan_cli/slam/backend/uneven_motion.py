"""Where the motion changes from one turn of the laser to the next: the path between the middles of two turns.

Without odometry, the poses at the middles of the turns are all that is known of the path. Where the robot
begins to turn between two of them, a steady motion from one to the next is off by some degrees there. But the
beams between two middles, the second half of one turn and the first half of the next, are as many as those of
a turn: they tell where the robot is halfway. Both are matched with the scans about them, each with its points
corrected by the path as it is known so far.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.robot_path import LONGEST_STEP, RobotPath, move_along_arc, poses_at, robot_path
from nscan_cli.matching.motion_model import Prior
from nscan_cli.matching.pairwise import settle_pair
from nscan_cli.ndt.hash_grid import WALL_DIRECTION
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, Indices, Mask, relative, wrap
from nscan_cli.slam.backend.options import UnevenMotionOptions
from nscan_cli.slam.options import SlamOptions


def path_of_turns(
    log: LaserLog, poses: Array, breaks: Sequence[int], options: SlamOptions
) -> RobotPath | None:
    """The path through poses (S, 3) at the middles of the turns, matched more finely where motion is uneven.

    The scans of `log` are stamped at the middles; the track broke before those in rows `breaks`. None of
    fewer than two scans.
    """
    uneven = options.uneven_motion
    poses, halfway, times = poses.copy(), list[Array](), list[float]()
    for first, last in _runs(_is_uneven(log.times, poses, breaks, uneven), uneven.longest_run):
        run = _Run(log, poses, (first, last), options)
        run.match(uneven.iterations)
        poses[first - 1 : last + 1] = run.middles
        times += run.times[run.is_halfway].tolist()
        halfway.append(run.poses[run.is_halfway])
    all_times = np.concatenate([log.times, times])
    order = np.argsort(all_times, kind="stable")
    return robot_path(all_times[order], np.concatenate([poses, *halfway])[order])


def _is_uneven(times: Array, poses: Array, breaks: Sequence[int], options: UnevenMotionOptions) -> Mask:
    """(S,) whether the motion from the scan before differs from that before it, or from the next one."""
    seconds = np.diff(times)
    usual = float(np.median(seconds)) if len(seconds) else 0.0
    steps = relative(poses[1:], poses[:-1])
    known = (seconds > 0.0) & (seconds < min(LONGEST_STEP, options.longest_step * usual))
    known[np.array(breaks, dtype=np.int64) - 1] = False
    steps = steps * (usual / np.where(known, seconds, 1.0))[:, None]
    change = np.abs(np.diff(steps, axis=0))
    change = np.maximum(np.hypot(change[:, 0], change[:, 1]), change[:, 2])
    changes = (change > options.min_change) & known[1:] & known[:-1]
    is_uneven = np.zeros(len(times), dtype=np.bool_)
    is_uneven[1:-1] |= changes
    is_uneven[2:] |= changes
    return is_uneven


def _runs(marks: Mask, longest: int) -> Iterator[tuple[int, int]]:
    """First and last row of each run of marks (S,), cut into parts of no more than so many rows."""
    rows = np.flatnonzero(marks)
    for run in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
        for begin in range(0, len(run), longest):
            part = run[begin : begin + longest]
            yield int(part[0]), int(part[-1])


class _Run:
    """Scans in uneven motion, and those about them that they are matched with."""

    def __init__(self, log: LaserLog, poses: Array, rows: tuple[int, int], options: SlamOptions) -> None:
        """Those of the first to the last of `rows`; `poses` (S, 3) are those of all scans."""
        self._log, self._options, (self._first, self._last) = log, options, rows
        apart, halfway = options.uneven_motion.scans, np.arange(self._first, self._last + 1)
        self._begin, end = max(self._first - 1 - apart, 0), min(self._last + 1 + apart, len(log))
        self._count = end - self._begin
        between = 0.5 * (log.times[halfway - 1] + log.times[halfway])
        times = np.concatenate([log.times[self._begin : end], between])
        self._order = np.argsort(times, kind="stable")
        self.times = times[self._order]
        """(n,) of the poses of the path that is looked for, s."""
        self.is_halfway = self._order >= self._count
        """(n,) whether they are between the middles of two turns."""
        known = robot_path(log.times[self._begin : end], poses[self._begin : end])
        assert known is not None
        self.poses = poses_at(known, self.times)
        """(n, 3)"""
        self._standing, self._seen = replace(log, path=None), dict[int, tuple[Array, Array]]()
        self._others = np.concatenate(
            [np.arange(self._begin, self._first - 1), np.arange(self._last + 1, end)]
        )

    @property
    def middles(self) -> Array:
        """The poses (m, 3) at the middles of the turns from that before the first row to that of the last."""
        found: Array = self.poses[self._places(np.arange(self._first - 1, self._last + 1))]
        return found

    def _places(self, rows: Indices) -> Indices:
        """(n,) the places of the middles of the turns in rows (n,) among the times."""
        places: Indices = np.argsort(self._order)[rows - self._begin]
        return places

    def match(self, iterations: int) -> None:
        """Match all poses of the run one after another, each with the path that those before have led to."""
        if len(self._others) < self._options.uneven_motion.scans:
            return
        reference, uneven = self._reference(), self._options.uneven_motion
        first, last = self._places(np.array([self._first - 1, self._last])).tolist()
        moved = np.zeros(len(self.times))
        moved[first : last + 1] = np.inf
        for _ in range(iterations):
            before = moved.copy()
            moved[:] = 0.0
            for place in range(first, last + 1):
                # A pose whose neighbours stay fits as before.
                if max(before[max(place - 1, 0) : place + 2].max(), moved[place - 1]) > uneven.settled:
                    moved[place] = self._settle(reference, place)
            if moved.max() <= uneven.settled:
                break

    def _reference(self) -> Ndt:
        """The Gaussians of the scans on both sides."""
        gaussians, reach = self._options.nscan.gaussians, self._options.tracking.max_range
        moving = replace(self._log, path=robot_path(self.times, self.poses))
        points = [moving.batch_points(slice(row, row + 1), reach)[0] for row in self._others.tolist()]
        ends = np.cumsum([0, *(len(each) for each in points)])
        poses = self.poses[self._places(self._others)]
        return Ndt.of_scans(
            np.concatenate(points), ends, poses, gaussians.cell, gaussians.minimum, gaussians.floor,
            neighbourhood=WALL_DIRECTION,
        )  # fmt: skip

    def _points_at(self, place: int) -> Array:
        """The points (m, 2) of the turn of the laser about one of the times, seen from the pose there."""
        if place not in self._seen:
            self._seen[place] = self._seen_about(place)
        points, seconds = self._seen[place]
        found = []
        for other, side in ((place - 1, seconds <= 0.0), (place + 1, seconds > 0.0)):
            # At an end of the path the motion goes on.
            begin = other if 0 <= other < len(self.times) else 2 * place - other
            period = float(self.times[place] - self.times[begin])
            moved, shares = points[side], seconds[side] / period
            if period != 0.0:
                step = relative(self.poses[place], self.poses[begin])
                move_along_arc(moved, shares, step, False)
            found.append(moved)
        return np.concatenate(found)

    def _seen_about(self, place: int) -> tuple[Array, Array]:
        """Points (m, 2) of the turn about one of the times, as if the robot stood, and times (m,) from it."""
        number, reach = int(self._order[place]), self._options.tracking.max_range
        row = self._begin + number if number < self._count else self._first + number - self._count
        points, seconds = [], []
        every = max(self._log.ranges.shape[1] // self._options.uneven_motion.max_beams, 1)
        for each in (row,) if number < self._count else (row - 1, row):
            one = slice(each, each + 1)
            since = self._log.times[each] - self.times[place]
            points.append(self._standing.batch_points(one, reach)[0][::every])
            seconds.append(self._standing.point_times(one, reach)[::every] + since)
        if number < self._count:
            return points[0], seconds[0]
        # The second half of the turn before, and the first half of the next.
        halves = (
            seconds[0] > self._log.times[row - 1] - self.times[place],
            seconds[1] < self._log.times[row] - self.times[place],
        )
        return (
            np.concatenate([each[half] for each, half in zip(points, halves, strict=True)]),
            np.concatenate([each[half] for each, half in zip(seconds, halves, strict=True)]),
        )

    def _settle(self, reference: Ndt, place: int) -> float:
        """Move the pose of one of the times to where its points fit best near it; by how much, m and rad."""
        uneven, start = self._options.uneven_motion, self.poses[place].copy()
        points = self._points_at(place)
        if len(points) < uneven.min_points:
            return 0.0
        information = np.diag([uneven.sigma**-2, uneven.sigma**-2, uneven.turn_sigma**-2])
        end = settle_pair(reference, points, start, uneven.pair, Prior(start, information))
        off = end.pose - start
        off[2] = wrap(off[2])
        near = np.hypot(off[0], off[1]) < 3 * uneven.sigma and abs(off[2]) < 3 * uneven.turn_sigma
        if end.overlap < uneven.min_overlap or not near:
            return 0.0
        self.poses[place] = end.pose
        return float(np.abs(off).max())
