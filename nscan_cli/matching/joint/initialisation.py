"""Where n scans lie when their start is poor: placed one by one, by search, among those placed before.

What two scans leave open, a third one decides: each scan is searched against all that are placed already,
and of those that are left the one that fits best comes next. It depends on where one begins, so every scan
is tried as the first; the neutral energy chooses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nscan_cli.matching.correlative_search import Field, SearchOptions, Spot, likelihood_field, search
from nscan_cli.matching.joint.joint_energy import JointProblem
from nscan_cli.matching.joint.joint_match import JointMatch, JointOptions, PairsAt, match_near_and_far
from nscan_cli.matching.joint.neutral_energy import neutral_energy, pair_energies
from nscan_cli.matching.joint.overlap import SOUND_OVERLAP, Overlaps, overlaps, weakest_link
from nscan_cli.matching.pairwise import PairOptions
from nscan_cli.matching.pairwise_solver import PairProblem, minimise
from nscan_cli.matching.priors import Prior
from nscan_cli.ndt.association import begin
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, compose, relative, transform

LEVER = 2.0
"""m"""
SWEEPS = 3
"""How often every scan is searched again among all others, as long as that helps."""
WIDENINGS = np.array([0.3, 1.0])
"""Stages in which a pose that was found becomes exact: the search leaves 0.1 m or so."""


def match_or_search(
    problem: JointProblem,
    points: Sequence[Array],
    start: Array,
    options: PairOptions,
    joint: JointOptions,
    pairs_at: PairsAt | None = None,
) -> tuple[JointMatch, Overlaps]:
    """Match n scans with points (m_i, 2) from the poses `start` (n, 3), and search where that does not do.

    A match is sound when all scans hang together by large overlaps, and each adds to the neutral energy
    what lowers it. If it is not, the scans are placed by search and matched from there; the result counts
    if they hang together then, and its neutral energy is lower. With the match come the overlaps there.
    """
    match = match_near_and_far(problem, start, joint, pairs_at)
    shares = overlaps(problem.scans, match.poses)
    if weakest_link(shares.pairs) >= SOUND_OVERLAP and _all_fit(problem, match.poses):
        return match, shares
    placed = Initialisation(problem, points, start, options, SearchOptions()).best()
    if joint.fixed is None:
        motion = _motion(placed, start)
    else:
        motion = compose(start[joint.fixed], relative(np.zeros(3), placed[joint.fixed]))
    other = match_near_and_far(problem, compose(motion, placed), joint, pairs_at)
    energies = [neutral_energy(problem, each.poses) for each in (match, other)]
    other_shares = overlaps(problem.scans, other.poses)
    better = energies[1] < energies[0] and weakest_link(other_shares.pairs) >= SOUND_OVERLAP
    both = replace(
        other if better else match,
        iterations=match.iterations + other.iterations,
        evaluations=match.evaluations + other.evaluations,
        searched=better,
    )
    return both, other_shares if better else shares


def _all_fit(problem: JointProblem, poses: Array) -> bool:
    """Whether the pairs of every scan together have a neutral energy below zero."""
    values = pair_energies(problem, poses)
    return bool(np.all(values.sum(axis=0) + values.sum(axis=1) <= 0.0))


class Initialisation:
    """n scans with points (m_i, 2) about poses `start` (n, 3)."""

    def __init__(
        self,
        problem: JointProblem,
        points: Sequence[Array],
        start: Array,
        options: PairOptions,
        window: SearchOptions,
    ) -> None:
        self.problem, self.points, self.start = problem, points, start
        self.options, self.window = options, window

    def best(self) -> Array:
        """The poses (n, 3) of the lowest neutral energy that were found."""
        placed = [self._placed_from(first) for first in range(len(self.points))]
        return self._placed_again(min(placed, key=self._energy))

    def _energy(self, poses: Array) -> float:
        return neutral_energy(self.problem, poses)

    def _placed_from(self, first: int) -> Array:
        """Place all scans one by one, the best fitting next; `first` stays at its start."""
        poses = self.start.copy()
        placed, left = [first], [scan for scan in range(len(poses)) if scan != first]
        while left:
            field = likelihood_field(self._cloud(placed, poses), self.window)
            best: tuple[int, Spot] | None = None
            for scan in left:
                least = best[1].score if best else 0.0
                found = self._search(scan, field, placed, poses, least)
                if found:
                    best = scan, found
            if best is None:
                break
            scan, found = best
            poses[scan] = self._exact(scan, found.pose, placed, poses)
            placed.append(scan)
            left.remove(scan)
        return poses

    def _placed_again(self, poses: Array) -> Array:
        """Search every scan among all others, and take what lowers the energy."""
        energy = self._energy(poses)
        for _ in range(SWEEPS):
            before = energy
            for scan in range(len(poses)):
                others = [other for other in range(len(poses)) if other != scan]
                field = likelihood_field(self._cloud(others, poses), self.window)
                found = self._search(scan, field, others, poses, 0.0)
                if found is None:
                    continue
                trial = poses.copy()
                trial[scan] = self._exact(scan, found.pose, others, poses)
                if self._energy(trial) < energy:
                    poses, energy = trial, self._energy(trial)
            if energy == before:
                break
        return poses

    def _cloud(self, placed: Sequence[int], poses: Array) -> Array:
        return np.concatenate([transform(poses[scan], self.points[scan]) for scan in placed])

    def _search(
        self, scan: int, field: Field, placed: Sequence[int], poses: Array, least: float
    ) -> Spot | None:
        """Search a scan about where it lies if the placed ones have moved as a whole from their start."""
        expected = compose(_motion(self.start[placed], poses[placed]), self.start[scan])
        return search(field, self.points[scan], expected, least, self.window)

    def _exact(self, scan: int, pose: Array, placed: Sequence[int], poses: Array) -> Array:
        """The pose (3,) matched with the NDT of all placed scans."""
        options, pose = self.options, pose.copy()
        ndt = Ndt.empty(options.cell, options.minimum, options.floor)
        for other in placed:
            ndt.add(self.points[other], poses[other])
        none = Prior(np.zeros(3), np.zeros((3, 3)))
        problem = PairProblem(ndt.grid, ndt.half, begin(self.points[scan]), options.scale, none)
        minimise(
            problem,
            pose,
            WIDENINGS,
            options.max_iterations,
            options.tolerance,
            options.tolerance,
            np.empty((3, 3)),
        )
        return pose


def _motion(before: Array, after: Array) -> Array:
    """The rigid motion (3,) that takes poses (k, 3) nearest to others: by their places and their angles."""
    a, b = before[:, :2] - before[:, :2].mean(axis=0), after[:, :2] - after[:, :2].mean(axis=0)
    turns = after[:, 2] - before[:, 2]
    # A radian weighs as much as LEVER metres.
    cos = (a * b).sum() + LEVER**2 * np.cos(turns).sum()
    sin = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() + LEVER**2 * np.sin(turns).sum()
    turn = np.array([0.0, 0.0, np.arctan2(sin, cos)])
    shift = after[:, :2].mean(axis=0) - transform(turn, before[:, :2].mean(axis=0)[None])[0]
    return np.array([shift[0], shift[1], turn[2]])
