"""Initial poses of n scans whose start is poor: each is searched among those that are placed already.

What two scans leave open, a third one decides. Of the scans that are left, the one that fits best is placed
next. The result depends on the first scan, so each is tried as the first, and the neutral energy decides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.matching.correlative_search import FoundPose, search
from nscan_cli.matching.joint.joint_energy import JointProblem
from nscan_cli.matching.joint.joint_match import JointMatch, PairsAt, match_near_and_far
from nscan_cli.matching.joint.neutral_energy import neutral_energy, pair_energies
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.joint.overlap import Overlaps, overlaps, weakest_link
from nscan_cli.matching.likelihood_field import LikelihoodField, likelihood_field
from nscan_cli.matching.motion_model import no_prior
from nscan_cli.matching.pairwise import PairOptions
from nscan_cli.matching.pairwise_solver import PairProblem, minimise_pairwise
from nscan_cli.ndt.association import begin_association
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, compose, relative, transform


def match_or_search(
    problem: JointProblem,
    points: Sequence[Array],
    start: Array,
    options: PairOptions,
    joint: JointOptions,
    pairs_at: PairsAt | None = None,
) -> tuple[JointMatch, Overlaps]:
    """Match n scans with points (m_i, 2) from the poses `start` (n, 3), with a search if that is not sound.

    A match is sound if large overlaps connect all scans, and if each scan lowers the neutral energy. If it is
    not sound, the scans are placed by search and matched from there. That match is taken if overlaps connect
    its scans and its neutral energy is lower. Returns the overlaps of the match, too.
    """
    match = match_near_and_far(problem, start, joint, pairs_at)
    shares = overlaps(problem.scans, match.poses, joint.inlier_bound)
    share = joint.overlap_reward
    if weakest_link(shares.pairs) >= joint.sound_overlap and _all_fit(problem, match.poses, share):
        return match, shares
    placed = Initialisation(problem, points, start, options, joint).best()
    if joint.fixed is None:
        motion = _rigid_motion(placed, start, joint.initialisation.lever)
    else:
        motion = compose(start[joint.fixed], relative(np.zeros(3), placed[joint.fixed]))
    other = match_near_and_far(problem, compose(motion, placed), joint, pairs_at)
    energies = [neutral_energy(problem, each.poses, share) for each in (match, other)]
    other_shares = overlaps(problem.scans, other.poses, joint.inlier_bound)
    better = energies[1] < energies[0] and weakest_link(other_shares.pairs) >= joint.sound_overlap
    both = replace(
        other if better else match,
        iterations=match.iterations + other.iterations,
        evaluations=match.evaluations + other.evaluations,
        searched=better,
    )
    return both, other_shares if better else shares


def _all_fit(problem: JointProblem, poses: Array, share: float) -> bool:
    """Whether the neutral energy of each scan's pairs is below zero."""
    values = pair_energies(problem, poses, share)
    return bool(np.all(values.sum(axis=0) + values.sum(axis=1) <= 0.0))


@dataclass(frozen=True)
class Initialisation:
    """The search for the poses of n scans with points (m_i, 2) near `start` (n, 3)."""

    problem: JointProblem
    points: Sequence[Array]
    start: Array
    options: PairOptions
    joint: JointOptions

    def best(self) -> Array:
        """The poses (n, 3) of the lowest neutral energy that were found."""
        placed = [self._placed_from(first) for first in range(len(self.points))]
        return self._placed_again(min(placed, key=self._energy))

    def _energy(self, poses: Array) -> float:
        return neutral_energy(self.problem, poses, self.joint.overlap_reward)

    def _placed_from(self, first: int) -> Array:
        """Place all scans one by one, the one that fits best next; `first` stays at its start."""
        poses = self.start.copy()
        placed, left = [first], [scan for scan in range(len(poses)) if scan != first]
        while left:
            field = self._field_of(placed, poses)
            best: tuple[int, FoundPose] | None = None
            for scan in left:
                least = best[1].score if best else 0.0
                found = self._search(scan, field, placed, poses, least)
                if found:
                    best = scan, found
            if best is None:
                break
            scan, found = best
            poses[scan] = self._refined(scan, found.pose, placed, poses)
            placed.append(scan)
            left.remove(scan)
        return poses

    def _placed_again(self, poses: Array) -> Array:
        """Search every scan among all others, and take what lowers the energy."""
        energy = self._energy(poses)
        for _ in range(self.joint.initialisation.passes):
            before = energy
            for scan in range(len(poses)):
                others = [other for other in range(len(poses)) if other != scan]
                field = self._field_of(others, poses)
                found = self._search(scan, field, others, poses, 0.0)
                if found is None:
                    continue
                trial = poses.copy()
                trial[scan] = self._refined(scan, found.pose, others, poses)
                if self._energy(trial) < energy:
                    poses, energy = trial, self._energy(trial)
            if energy == before:
                break
        return poses

    def _field_of(self, placed: Sequence[int], poses: Array) -> LikelihoodField:
        points = [transform(poses[scan], self.points[scan]) for scan in placed]
        return likelihood_field(np.concatenate(points), self.joint.initialisation.search)

    def _search(
        self, scan: int, field: LikelihoodField, placed: Sequence[int], poses: Array, least: float
    ) -> FoundPose | None:
        """Search a scan near its start, moved as the placed scans have moved as a whole."""
        options = self.joint.initialisation
        motion = _rigid_motion(self.start[placed], poses[placed], options.lever)
        expected = compose(motion, self.start[scan])
        return search(field, self.points[scan], expected, least, options.search)

    def _refined(self, scan: int, pose: Array, placed: Sequence[int], poses: Array) -> Array:
        """The pose (3,) matched with the NDT of all placed scans."""
        options, pose = self.options, pose.copy()
        ndt = Ndt.empty(options)
        for other in placed:
            ndt.add(self.points[other], poses[other])
        association = begin_association(self.points[scan])
        problem = PairProblem(ndt.grid, ndt.half, association, options.scale, no_prior())
        limits = options.max_iterations, options.tolerance, options.tolerance
        widenings = np.array(self.joint.initialisation.widenings)
        minimise_pairwise(problem, pose, widenings, *limits, np.empty((3, 3)))
        return pose


def _rigid_motion(before: Array, after: Array, lever: float) -> Array:
    """The rigid motion (3,) that takes poses (k, 3) nearest to others; a radian weighs as `lever` metres."""
    a, b = before[:, :2] - before[:, :2].mean(axis=0), after[:, :2] - after[:, :2].mean(axis=0)
    turns = after[:, 2] - before[:, 2]
    cos = (a * b).sum() + lever**2 * np.cos(turns).sum()
    sin = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() + lever**2 * np.sin(turns).sum()
    turn = np.array([0.0, 0.0, np.arctan2(sin, cos)])
    shift = after[:, :2].mean(axis=0) - transform(turn, before[:, :2].mean(axis=0)[None])[0]
    return np.array([shift[0], shift[1], turn[2]])
