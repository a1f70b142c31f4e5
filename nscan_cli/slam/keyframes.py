"""Step 2 of the loop (paper, V): the scans that the graph is made of, each with the Gaussians around it.

A keyframe's NDT grows by the scans between its neighbours, as tracking placed them: a few centimetres of
motion fill the gaps between the beams. Its points are those of its own scan.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nscan_cli.graph.model import Pairwise
from nscan_cli.ndt.grid import Ndt
from nscan_cli.poses import Array, Indices, compose, relative
from nscan_cli.slam.options import GaussianOptions, KeyframeOptions
from nscan_cli.slam.tracking import Tracked

ROOM = 16
"""Lattice cells for each point of a scan that an NDT has room for at first. Most need no more."""


@dataclass
class Keyframe:
    """A scan of the graph."""

    row: int
    """In the log; the id of its node."""
    tracked: Tracked
    expected: Array
    """(3, 3) covariance of the way from the keyframe before, had nothing been matched."""
    points: Array
    """(m, 2) in the robot's frame."""
    cells: int
    """How many lattice cells of the NDT its points fall into."""
    gaussians: GaussianOptions
    around: list[tuple[Array, Tracked]]
    """What the NDT is to be made of: the points of the scans around, its own first."""
    _ndt: Ndt | None = None

    @property
    def ndt(self) -> Ndt:
        """The Gaussians of its scans, which are made when they are first asked for."""
        return self.finish()

    def finish(self) -> Ndt:
        """Make the Gaussians, unless they are there, and let the scans go; none can join any more."""
        around = self.around
        if self._ndt is None:
            poses = relative(np.array([tracked.pose for _, tracked in around]), self.tracked.pose)
            ndt = Ndt(
                self.gaussians.cell, self.gaussians.minimum, self.gaussians.floor, ROOM * len(self.points)
            )
            ndt.gather([points for points, _ in around], poses)
            ndt.compact()
            # In this order: another thread that makes it too has what it needs.
            self._ndt, self.around = ndt, []
        return self._ndt


class Route(NamedTuple):
    """K keyframes along the path, and where the graph has them."""

    keyframes: Sequence[Keyframe]
    rows: Indices
    """(K,) theirs in the log, which are the ids of their nodes."""
    chain: Sequence[Pairwise]
    """The relations of tracking: `chain[k]` leads from keyframe k to k + 1."""
    paths: Array
    """(K,) the length of path up to each, m."""
    poses: Array
    """(K, 3) global ones."""


def points_per_cell(keyframes: Iterable[Keyframe]) -> float:
    """How many points of a scan fall into a lattice cell on average, of those that have any; at least 1."""
    points, cells = np.sum([(len(each.points), each.cells) for each in keyframes], axis=0)
    return float(points / cells) if cells else 1.0


def _count_cells(points: Array, side: float) -> int:
    return len(np.unique(np.floor(points / side) @ np.array([1.0, 1j])))


def route_of(keyframes: Sequence[Keyframe], chain: Sequence[Pairwise], poses: Array) -> Route:
    """The route of as many keyframes as there are poses (K, 3)."""
    keyframes = keyframes[: len(poses)]
    rows = np.array([keyframe.row for keyframe in keyframes], dtype=np.int64)
    paths = np.array([keyframe.tracked.path for keyframe in keyframes])
    return Route(keyframes, rows, chain[: max(len(poses) - 1, 0)], paths, poses)


def extended(route: Route, keyframes: Sequence[Keyframe], chain: Sequence[Pairwise]) -> Route:
    """The route with more keyframes at its end, where the relations that lead to each of them place them."""
    poses = [route.poses[-1]]
    for relation in chain:
        poses.append(compose(poses[-1], relation.measurement))
    return Route(
        [*route.keyframes, *keyframes],
        np.append(route.rows, [keyframe.row for keyframe in keyframes]).astype(np.int64),
        [*route.chain, *chain],
        np.append(route.paths, [keyframe.tracked.path for keyframe in keyframes]),
        np.vstack([route.poses, *poses[1:]]),
    )


class Keyframes:
    """The keyframes in order of time, and the scans since the last of them.

    `median_range` (m) is that of the log's beams.
    """

    def __init__(
        self, options: KeyframeOptions, gaussians: GaussianOptions, median_range: float = 0.0
    ) -> None:
        self.options, self.gaussians = options, gaussians
        self.distance = max(options.distance, options.distance_per_range * median_range)
        self.list: list[Keyframe] = []
        self._since: list[tuple[Array, Tracked]] = []
        self._expected = np.zeros((3, 3))

    def __len__(self) -> int:
        return len(self.list)

    def near_enough(self, tracked: Tracked) -> bool:
        """Whether the last keyframe is near enough to a scan that it need not become one."""
        if not self.list:
            return False
        # Asked for every scan, and arrays of three numbers cost ten times more.
        x, y, angle = tracked.pose.tolist()
        last_x, last_y, last_angle = self.list[-1].tracked.pose.tolist()
        turned = math.remainder(angle - last_angle, 2 * math.pi)
        return math.hypot(x - last_x, y - last_y) <= self.distance and abs(turned) <= self.options.turn

    def attach(self, points: Array, tracked: Tracked) -> None:
        """Let a scan between keyframes add to the Gaussians of both."""
        self._expected += tracked.expected
        if tracked.joined:
            self._since.append((points.copy(), tracked))

    def add(self, row: int, points: Array, tracked: Tracked) -> Keyframe:
        """Make a scan a keyframe; the one before has all its scans then."""
        # Of its own: else it would keep what the scans around it have, which were tracked together.
        points, tracked, since = points.copy(), tracked.copy(), self._since
        self.part()
        cells = _count_cells(points, 0.5 * self.gaussians.cell)
        around = [(points, tracked), *since]
        keyframe = Keyframe(
            row, tracked, self._expected + tracked.expected, points, cells, self.gaussians, around
        )
        self._expected = np.zeros((3, 3))
        self.list.append(keyframe)
        return keyframe

    def part(self) -> None:
        """The scans since the last keyframe belong to it alone: the track ends, or begins anew."""
        if self.list:
            self.list[-1].around.extend(self._since)
        self._since = []


def relation_between(before: Keyframe, last: Keyframe, options: KeyframeOptions) -> Pairwise:
    """The pairwise relation of a keyframe to the one before it, as it was tracked.

    The information is that of the match, weighed down, and of the motion that was expected; drift that
    no match shows limits it.
    """
    c, s = np.cos(before.tracked.pose[2]), np.sin(before.tracked.pose[2])
    rotation = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    information = options.information_scale * rotation @ last.tracked.hessian @ rotation.T
    length = last.tracked.path - before.tracked.path
    drift = np.array([options.drift, options.drift, options.drift_angle]) ** 2 * (length + 0.01)
    covariance = np.linalg.inv(information + np.linalg.inv(last.expected)) + np.diag(drift)
    return Pairwise(
        nodes=(before.row, last.row),
        measurement=relative(last.tracked.pose, before.tracked.pose),
        information=np.linalg.inv(covariance),
        origin="track",
        score=last.tracked.inliers,
    )
