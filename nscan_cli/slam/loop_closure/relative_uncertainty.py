"""The uncertainty of a keyframe's pose as seen from another keyframe (paper, V: large loops)."""

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


class HeldPoseMarginals(NamedTuple):
    """The marginals of a graph's poses when one of them is held."""

    held: int
    poses: Array
    """(K, 3)"""
    free: Indices
    """(F,) the others that are computed, the held one not among them, in the factor's order."""
    factor: Factor
    covariances: Array
    """(K, 3, 3), 0 for the held one, inf for those that are not computed or that nothing holds."""

    def sigma(self) -> RelativeSigma:
        """Standard deviations as seen from the held pose."""
        return _sigma_of(self.covariances)

    def seen_from(self, other: int) -> RelativeSigma:
        """Standard deviations as seen from another pose, as if that one were held.

        With d from there to a pose and A = [[−1, 0, d_y], [0, −1, −d_x], [0, 0, −1]], a pose moves relative
        to it by its own motion plus A times that of the other.
        """
        if other == self.held:
            return self.sigma()
        if not np.isfinite(self.covariances[other]).all():
            # Nothing is known from where nobody knows where it is, but of itself.
            unknown = np.full_like(self.covariances, np.inf)
            unknown[other] = 0.0
            return _sigma_of(unknown)
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
        return _sigma_of(relative)


def held_pose_marginals(energy: GraphEnergy, poses: Array) -> HeldPoseMarginals:
    """The marginals of the poses (K, 3) with the energy's fixed one held.

    As in marginal_covariances, the information is half the Hessian's Gauss–Newton part.
    """
    factor = factorise(energy.pattern, 0.5 * energy.evaluate(poses, exact=False).hessian)
    covariances = np.full((len(poses), 3, 3), np.inf)
    covariances[energy.fixed], covariances[energy.free] = 0.0, inverse_diagonal(factor)
    if factor.loose.any():
        covariances[energy.free[undetermined_nodes(factor)]] = np.inf
    return HeldPoseMarginals(energy.fixed, poses, energy.free, factor, covariances)


def _sigma_of(covariances: Array) -> RelativeSigma:
    """The standard deviations of covariances (K, 3, 3); inf where a covariance is."""
    known = np.isfinite(covariances[:, 0, 0])
    distance, angle = np.full((2, len(covariances)), np.inf)
    xx, xy, yy = covariances[known, 0, 0], covariances[known, 0, 1], covariances[known, 1, 1]
    distance[known] = np.sqrt(np.maximum(0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy), 0.0))
    angle[known] = np.sqrt(np.maximum(covariances[known, 2, 2], 0.0))
    return RelativeSigma(distance, angle)


class RelativeUncertainty:
    """The uncertainty of all keyframes as seen from one that moves on, without solving the whole graph each
    time.

    Since the last computation the path is added as if only its own relations held it. That never
    underestimates, and costs next to nothing.
    """

    def __init__(self) -> None:
        self._origin = 0
        self._sigma = RelativeSigma(np.zeros(1), np.zeros(1))
        self._marginals: HeldPoseMarginals | None = None

    def compute(self, energy: GraphEnergy, poses: Array) -> RelativeSigma:
        """The standard deviations (K,) by the graph, as seen from the keyframe that its energy holds.

        If the energy holds other keyframes too, these keep the upper bound as seen from that keyframe.
        """
        self._marginals = held_pose_marginals(energy, poses)
        sigma = self._marginals.sigma()
        if len(energy.free) < len(poses) - 1:
            sigma = RelativeSigma(*np.where(np.isinf(sigma), self._sigma, sigma))
        self._origin, self._sigma = energy.fixed, sigma
        return sigma

    def seen_from(self, other: int) -> RelativeSigma:
        """The standard deviations (K,) as seen from another keyframe, by the graph that was computed last."""
        assert self._marginals is not None
        return self._marginals.seen_from(other)

    def tighten(self, origin: int, covariances: Array) -> RelativeSigma:
        """Lower the last upper bound, of `origin`, by covariances (K, 3, 3), each of which is an upper bound
        itself."""
        self._origin = origin
        self._sigma = RelativeSigma(*np.minimum(self._sigma, _sigma_of(covariances)))
        return self._sigma

    def upper_bound(self, origin: int, path: TrackedPath, poses: Array) -> RelativeSigma:
        """An upper bound from `origin` for the keyframes before it. The origin never goes back."""
        known = len(self._sigma.distance)
        distance, angle = np.zeros(len(poses)), np.zeros(len(poses))
        distance[:known], angle[:known] = self._sigma.distance**2, self._sigma.angle**2
        for step in range(self._origin, origin):
            covariance = path.covariances[step]
            _add_relation_variance(covariance, path.relations[step].measurement, poses, step, distance)
            angle[: step + 1] += covariance[2, 2]
        self._origin, self._sigma = origin, RelativeSigma(np.sqrt(distance), np.sqrt(angle))
        return self._sigma


@kernel
def _add_relation_variance(
    covariance: Array, measurement: Array, poses: Array, step: int, variances: Array
) -> None:
    """Add to (K,) the largest variances of positions up to `step`, as seen from the end of its relation.

    An error of the relation moves a point at v from its end, in its frame, by its shift, and by its turn
    times v rotated by a right angle.
    """
    cos, sin = np.cos(poses[step, 2]), np.sin(poses[step, 2])
    for k in range(step + 1):
        dx, dy = poses[k, 0] - poses[step, 0], poses[k, 1] - poses[step, 1]
        vx, vy = cos * dx + sin * dy - measurement[0], cos * dy - sin * dx - measurement[1]
        xx = covariance[0, 0] - vy * (2 * covariance[0, 2] - vy * covariance[2, 2])
        yy = covariance[1, 1] + vx * (2 * covariance[1, 2] + vx * covariance[2, 2])
        xy = covariance[0, 1] + vx * covariance[0, 2] - vy * (covariance[1, 2] + vx * covariance[2, 2])
        variances[k] += 0.5 * (xx + yy) + np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
