"""How far a keyframe may be from where the graph has it, seen from another one (paper, V: large loops)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.graph.linalg.block_cholesky import Factor, factorise, solve, undetermined_nodes
from nscan_cli.graph.linalg.selected_inverse import inverse_diagonal
from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.kernels.decorators import kernel
from nscan_cli.poses import Array, Indices
from nscan_cli.slam.keyframes.tracked_path import TrackedPath


class RelativeSigma(NamedTuple):
    """Standard deviations of keyframes as seen from one of them; 0 for that one."""

    distance: Array
    """(K,) m, in the direction in which it is greatest."""
    angle: Array
    """(K,) rad"""


class Known(NamedTuple):
    """What a graph knows of its poses when one of them is held."""

    held: int
    poses: Array
    """(K, 3)"""
    free: Indices
    """(F,) those that were asked for, the held one not among them, in the factor's order."""
    factor: Factor
    covariances: Array
    """(K, 3, 3), 0 for the held one, inf for those that were not asked for, or that nothing holds."""

    def reach(self) -> RelativeSigma:
        """As seen from the held one."""
        return _reach(self.covariances)

    def seen_from(self, other: int) -> RelativeSigma:
        """As seen from another one, which is what would be known with that one held.

        With d from there to a pose and A = [[−1, 0, d_y], [0, −1, −d_x], [0, 0, −1]], a pose moves there by
        its own motion plus A times that of the other.
        """
        if other == self.held:
            return self.reach()
        if not np.isfinite(self.covariances[other]).all():
            # Nothing is known from where nobody knows where it is, but of itself.
            unknown = np.full_like(self.covariances, np.inf)
            unknown[other] = 0.0
            return _reach(unknown)
        with_other, row = np.zeros_like(self.covariances), int(np.searchsorted(self.free, other))
        for component in range(3):
            unit = np.zeros((len(self.free), 3))
            unit[row, component] = 1.0
            with_other[self.free, :, component] = solve(self.factor, unit)
        by_other = np.tile(-np.eye(3), (len(self.poses), 1, 1))
        d = self.poses[:, :2] - self.poses[other, :2]
        by_other[:, 0, 2], by_other[:, 1, 2] = d[:, 1], -d[:, 0]
        half = by_other @ (
            0.5 * self.covariances[other] @ by_other.transpose(0, 2, 1) + with_other.transpose(0, 2, 1)
        )
        relative = self.covariances + half + half.transpose(0, 2, 1)
        relative[other] = 0.0
        return _reach(relative)


def known(energy: GraphEnergy, poses: Array) -> Known:
    """The marginals of the poses (K, 3) with the energy's fixed one held.

    As in marginal_covariances, the information is half the Hessian's Gauss–Newton part.
    """
    factor = factorise(energy.pattern, 0.5 * energy.evaluate(poses, exact=False).hessian)
    covariances = np.full((len(poses), 3, 3), np.inf)
    covariances[energy.fixed], covariances[energy.free] = 0.0, inverse_diagonal(factor)
    if factor.loose.any():
        covariances[energy.free[undetermined_nodes(factor)]] = np.inf
    return Known(energy.fixed, poses, energy.free, factor, covariances)


def _reach(covariances: Array) -> RelativeSigma:
    """Of covariances (K, 3, 3); inf where they are."""
    known = np.isfinite(covariances[:, 0, 0])
    distance, angle = np.full((2, len(covariances)), np.inf)
    xx, xy, yy = covariances[known, 0, 0], covariances[known, 0, 1], covariances[known, 1, 1]
    distance[known] = np.sqrt(_greatest(xx, xy, yy))
    angle[known] = np.sqrt(np.maximum(covariances[known, 2, 2], 0.0))
    return RelativeSigma(distance, angle)


def _greatest(xx: Array, xy: Array, yy: Array) -> Array:
    """The greater eigenvalues (K,) of covariances [[xx, xy], [xy, yy]]."""
    return np.maximum(0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy), 0.0)


class RelativeUncertainty:
    """The reach of all keyframes from one that moves on, without asking the whole graph each time.

    Since it was asked, the way is added as if nothing but its own relations held it. That is never too
    little, and costs next to nothing.
    """

    def __init__(self) -> None:
        self._origin = 0
        self._reach = RelativeSigma(np.zeros(1), np.zeros(1))
        self._known: Known | None = None

    def ask(self, energy: GraphEnergy, poses: Array) -> RelativeSigma:
        """The reach (K,) from the keyframe at which the graph's energy is fixed.

        Where others are held too, theirs is the bound from that keyframe as it is.
        """
        self._known = known(energy, poses)
        reach = self._known.reach()
        if len(energy.free) < len(poses) - 1:
            reach = RelativeSigma(*np.where(np.isinf(reach), self._reach, reach))
        self._origin, self._reach = energy.fixed, reach
        return reach

    def asked_from(self, other: int) -> RelativeSigma:
        """The reach (K,) from another keyframe, by the graph that was asked last."""
        assert self._known is not None
        return self._known.seen_from(other)

    def narrow(self, origin: int, covariances: Array) -> RelativeSigma:
        """A bound again, by covariances (K, 3, 3) from `origin`, as last for `bound`, none too little."""
        reach = _reach(covariances)
        distance = np.minimum(self._reach.distance, reach.distance)
        self._origin, self._reach = (
            origin,
            RelativeSigma(distance, np.minimum(self._reach.angle, reach.angle)),
        )
        return self._reach

    def bound(self, origin: int, way: TrackedPath, poses: Array) -> RelativeSigma:
        """At most the reach from `origin`, of the keyframes before it. The origin never goes back."""
        known = len(self._reach.distance)
        distance, angle = np.zeros(len(poses)), np.zeros(len(poses))
        distance[:known], angle[:known] = self._reach.distance**2, self._reach.angle**2
        for step in range(self._origin, origin):
            covariance = way.covariances[step]
            _swing(covariance, way.relations[step].measurement, poses, step, distance)
            angle[: step + 1] += covariance[2, 2]
        self._origin, self._reach = origin, RelativeSigma(np.sqrt(distance), np.sqrt(angle))
        return self._reach


@kernel
def _swing(covariance: Array, measurement: Array, poses: Array, step: int, variances: Array) -> None:
    """Add to (K,) the greatest variances of positions up to `step`, seen from the end of its relation.

    By what the relation is off: what lies v from its end, in its frame, moves by its shift and by its turn
    times v turned by a right angle.
    """
    cos, sin = np.cos(poses[step, 2]), np.sin(poses[step, 2])
    for k in range(step + 1):
        dx, dy = poses[k, 0] - poses[step, 0], poses[k, 1] - poses[step, 1]
        vx, vy = cos * dx + sin * dy - measurement[0], cos * dy - sin * dx - measurement[1]
        xx = covariance[0, 0] - vy * (2 * covariance[0, 2] - vy * covariance[2, 2])
        yy = covariance[1, 1] + vx * (2 * covariance[1, 2] + vx * covariance[2, 2])
        xy = covariance[0, 1] + vx * covariance[0, 2] - vy * (covariance[1, 2] + vx * covariance[2, 2])
        variances[k] += 0.5 * (xx + yy) + np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
