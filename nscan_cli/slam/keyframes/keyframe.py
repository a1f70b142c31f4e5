"""Step 2 of the loop (paper, V): the scans that the graph is made of, each with the Gaussians around it.

A keyframe's NDT grows by the scans between its neighbours, as tracking placed them: a few centimetres of
motion fill the gaps between the beams. Its points are those of its own scan.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.graph.model import Pairwise
from nscan_cli.graph.relations.semidefinite import as_information
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.pose_kernels import wrapped
from nscan_cli.ndt.hash_grid import WALL_END
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, Indices, compose, relative
from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.tracked_scans import Tracked, TrackedScans
from nscan_cli.slam.keyframes.options import KeyframeOptions
from nscan_cli.slam.keyframes.slip_detection import SlipDetector

LATTICE = 2.0**26
"""More cells than a lattice has in a row."""
ROOM = 16
"""Lattice cells for each point of a scan that an NDT has room for at first. Most need no more."""


class KeyframePoints(NamedTuple):
    """Scans, with arrays of their own, and where tracking has them."""

    points: Array
    """(P, 2) one after another, each in its robot's frame."""
    sizes: Indices
    """(n,) how many each of them has."""
    poses: Array
    """(n, 3)"""


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
    around: list[KeyframePoints]
    """What the NDT is to be made of: the scans around, its own first."""
    _ndt: Ndt | None = None

    @property
    def ndt(self) -> Ndt:
        """The Gaussians of its scans, which are made when they are first asked for."""
        return self.finish()

    def finish(self) -> Ndt:
        """Make the Gaussians, unless they are there, and let the scans go; none can join any more."""
        around = self.around
        if self._ndt is None:
            points, sizes, poses = (np.concatenate(columns) for columns in zip(*around, strict=True))
            ends = np.append(0, np.cumsum(sizes))
            poses, own, room = relative(poses, self.tracked.pose), self.gaussians, ROOM * len(self.points)
            ndt = Ndt.of_scans(points, ends, poses, own.cell, own.minimum, own.floor, room, WALL_END)
            # In this order: another thread that makes it too has what it needs.
            self._ndt, self.around = ndt, []
        return self._ndt


class Route(NamedTuple):
    """K keyframes along the path, and where the graph has them."""

    keyframes: Sequence[Keyframe]
    """The first K are these; more may follow, which the graph does not have yet."""
    rows: Indices
    """(K,) theirs in the log, which are the ids of their nodes."""
    chain: Sequence[Pairwise]
    """The relations of tracking, of what follows too: `chain[k]` leads from keyframe k to k + 1."""
    paths: Array
    """(K,) the length of path up to each, m."""
    poses: Array
    """(K, 3) global ones."""


def points_per_cell(keyframes: Iterable[Keyframe]) -> float:
    """How many points of a scan fall into a lattice cell on average, of those that have any; at least 1."""
    points = cells = 0
    for keyframe in keyframes:
        points, cells = points + len(keyframe.points), cells + keyframe.cells
    return points / cells if cells else 1.0


@kernel
def _count_cells(points: Array, side: float) -> int:
    """How many cells of one lattice the points (m, 2) fall into."""
    cells = np.floor(points / side)
    # No laser sees so far that two cells would have the same number.
    numbers = np.sort(cells[:, 0] * LATTICE + cells[:, 1])
    count = 0
    for k in range(len(numbers)):
        count += k == 0 or numbers[k] != numbers[k - 1]
    return count


@kernel
def _new_keyframes(
    poses: Array,
    slipped: NDArray[np.bool_],
    first: int,
    before: Array,
    distance: float,
    turn: float,
    patience: float,
) -> Indices:
    """Which of the poses (n, 3), from the `first` on, are those of keyframes.

    Each is the first beyond `distance` (m) or `turn` (rad) of the one before; the first of all, of `before`.
    Where a scan may have slipped, beyond so many times as much as `patience` says.
    """
    new, count, last = np.empty(len(poses), dtype=np.int64), 0, before
    for k in range(first, len(poses)):
        away = np.hypot(poses[k, 0] - last[0], poses[k, 1] - last[1])
        times = patience if slipped[k] else 1.0
        if not (away <= times * distance and abs(wrapped(poses[k, 2] - last[2])) <= times * turn):
            new[count], last = k, poses[k]
            count += 1
    return new[:count].copy()


def route_of(keyframes: Sequence[Keyframe], chain: Sequence[Pairwise], poses: Array) -> Route:
    """The route of as many keyframes as there are poses (K, 3)."""
    own = keyframes[: len(poses)]
    rows = np.array([keyframe.row for keyframe in own], dtype=np.int64)
    return Route(keyframes, rows, chain, np.array([keyframe.tracked.path for keyframe in own]), poses)


def extended(route: Route, size: int) -> Route:
    """The route with the next of its keyframes, up to `size` of them, where the chain places them."""
    known = len(route.poses)
    new, poses = route.keyframes[known:size], [route.poses[-1]]
    for relation in route.chain[known - 1 : size - 1]:
        poses.append(compose(poses[-1], relation.measurement))
    return route._replace(
        rows=np.concatenate([route.rows, [keyframe.row for keyframe in new]], dtype=np.int64),
        paths=np.concatenate([route.paths, [keyframe.tracked.path for keyframe in new]]),
        poses=np.concatenate([route.poses, np.reshape(poses[1:], (-1, 3))]),
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
        self._slips = SlipDetector(options.slip_sigmas)
        self._since: list[KeyframePoints] = []
        self._expected = np.zeros((3, 3))

    def __len__(self) -> int:
        return len(self.list)

    def take(self, scans: ScanBatch, found: TrackedScans, begins: bool = False) -> None:
        """Take in scans that were found: some become keyframes, the first of them where a piece begins."""
        begins |= not self.list
        before = found.poses[0] if begins else self.list[-1].tracked.pose
        slipped, turn, patience = self._slips.among(found), self.options.turn, self.options.slip_factor
        new = _new_keyframes(
            found.poses, slipped, int(begins), before, self.distance, turn, patience
        ).tolist()
        first = 0
        for k in [0, *new] if begins else new:
            self.attach(scans, found, first, k)
            self.add(scans.first + k, scans.of(k), found.scan(k))
            first = k + 1
        self.attach(scans, found, first, len(scans))

    def attach(self, scans: ScanBatch, found: TrackedScans, first: int, end: int) -> None:
        """Let those from the `first` on, before the `end`, add to the Gaussians of the keyframes around."""
        self._expected = np.add.reduce(np.concatenate([self._expected[None], found.expected[first:end]]))
        joined = first + np.flatnonzero(found.joined[first:end])
        if len(joined):
            points, ends = scans.chosen(joined)
            self._since.append(KeyframePoints(points, np.diff(ends), found.poses[joined]))

    def add(self, row: int, points: Array, tracked: Tracked) -> Keyframe:
        """Make a scan a keyframe; the one before has all its scans then."""
        # Of its own: else it would keep what the scans around it have, which were tracked together.
        points, since = points.copy(), self._since
        self.part()
        cells = _count_cells(points, 0.5 * self.gaussians.cell)
        own = KeyframePoints(points, np.array([len(points)]), tracked.pose[None])
        keyframe = Keyframe(
            row, tracked, self._expected + tracked.expected, points, cells, self.gaussians, [own, *since]
        )
        self._expected = np.zeros((3, 3))
        self.list.append(keyframe)
        return keyframe

    def part(self) -> None:
        """The scans since the last keyframe belong to it alone: the track ends, or begins anew."""
        if self.list:
            self.list[-1].around.extend(self._since)
        self._since = []


def relations_along(keyframes: Sequence[Keyframe], options: KeyframeOptions) -> list[Pairwise]:
    """The pairwise relations of K keyframes, each to the one before it, as they were tracked; K − 1.

    The information is that of the match, weighed down, and of the motion that was expected; drift that
    no match shows limits it.
    """
    if len(keyframes) < 2:
        return []
    before, last = [each.tracked for each in keyframes[:-1]], [each.tracked for each in keyframes[1:]]
    angles = np.array([tracked.pose[2] for tracked in before])
    rotation = np.zeros((len(before), 3, 3))
    rotation[:, 0, 0] = rotation[:, 1, 1] = np.cos(angles)
    rotation[:, 0, 1] = np.sin(angles)
    rotation[:, 1, 0] = -rotation[:, 0, 1]
    rotation[:, 2, 2] = 1.0
    hessians = as_information(np.array([tracked.hessian for tracked in last]))
    expected = np.array([each.expected for each in keyframes[1:]])
    information = options.information_scale * rotation @ hessians @ rotation.transpose(0, 2, 1)
    lengths = np.array([b.path - a.path for a, b in itertools.pairwise(each.tracked for each in keyframes)])
    drift = np.array([options.drift, options.drift, options.drift_angle]) ** 2
    covariances = np.linalg.inv(information + np.linalg.inv(expected))
    covariances[:, range(3), range(3)] += drift * (lengths[:, None] + 0.01)
    return [
        Pairwise(
            nodes=(a.row, b.row),
            measurement=relative(b.tracked.pose, a.tracked.pose),
            information=known,
            origin="track",
            score=b.tracked.inliers,
        )
        for a, b, known in zip(keyframes[:-1], keyframes[1:], np.linalg.inv(covariances), strict=True)
    ]
