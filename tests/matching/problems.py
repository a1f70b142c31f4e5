"""Scans to match, with the poses that they were taken from."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.matching.joint.joint_energy import JointProblem, Priors, all_pairs, no_priors
from nscan_cli.matching.joint.scan_set import scan_set
from nscan_cli.matching.pairwise import PairOptions, matched_points, scan_ndt
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, relative, wrap
from tests.simulation.laser import exact
from tests.simulation.scenes import FIG_3, Scene, corridor_and_room, office

OPTIONS = PairOptions()


@dataclass(frozen=True)
class Problem:
    """n scans."""

    truth: Array
    """(n, 3)"""
    points: list[Array]
    ndts: list[Ndt]

    def __len__(self) -> int:
        return len(self.points)

    def joint(
        self,
        *chosen: int,
        pairs: NDArray[np.int64] | None = None,
        priors: Priors | None = None,
        scale: float = OPTIONS.scale,
    ) -> JointProblem:
        """Some of the scans, or all, to be matched jointly: all pairs and no priors if none are given."""
        kept = chosen or range(len(self))
        scans = scan_set([self.ndts[scan] for scan in kept], [self.points[scan] for scan in kept])
        index_set = all_pairs(len(kept)) if pairs is None else pairs
        return JointProblem(scans, index_set, priors or no_priors(), scale)


def problem(scene: Scene, truth: Array, noise: bool, seed: int = 1) -> Problem:
    """Scans taken from true poses (n, 3)."""
    log = scene.record_at(truth, seed, laser=scene.laser if noise else exact(scene.laser)).log()
    points = [matched_points(log, row, OPTIONS) for row in range(len(log))]
    return Problem(truth, points, [scan_ndt(part, OPTIONS) for part in points])


@functools.cache
def office_truth() -> Array:
    """(S, 3) the way through the office."""
    return office().truth()


def office_problem(rows: tuple[int, ...], noise: bool = True, seed: int = 1) -> Problem:
    """The office from the poses in `rows` of its drive."""
    return problem(office(), office_truth()[list(rows)], noise, seed)


def fig_3(noise: bool = False, seed: int = 1) -> Problem:
    """The three scans of the paper's Fig. 3."""
    return problem(corridor_and_room(), FIG_3, noise, seed)


def errors(poses: Array, truth: Array) -> Array:
    """(n, 3) differences of the poses seen from the first of each."""
    off = relative(poses, poses[0]) - relative(truth, truth[0])
    off[:, 2] = wrap(off[:, 2])
    return off


def near(truth: Array, seed: int, metres: float = 0.03, radians: float = 0.01) -> Array:
    """Poses (n, 3) near the truth, with errors up to these bounds (m, rad)."""
    rng = np.random.default_rng(seed)
    off: Array = truth + rng.uniform(-1, 1, truth.shape) * [metres, metres, radians]
    return off


def chain_priors(poses: Array, sigma: float) -> Priors:
    """Priors from each pose to the next, of one σ (m, rad)."""
    pairs = np.array([(at, at + 1) for at in range(len(poses) - 1)], dtype=np.int64).reshape(-1, 2)
    means = relative(poses[1:], poses[:-1])
    return Priors(pairs, means, np.tile(np.eye(3) * sigma**-2, (len(pairs), 1, 1)))
