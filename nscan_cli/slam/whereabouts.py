"""How far a keyframe may be from where the graph has it, seen from another one (paper, V: large loops)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nscan_cli.graph.cholesky import factorise, inverse_diagonal, loose_nodes
from nscan_cli.graph.model import Pairwise
from nscan_cli.graph.pattern import Indices
from nscan_cli.graph.system import GraphEnergy
from nscan_cli.poses import Array, relative

AROUND = 45.0
"""m; the part of the graph that is asked first. A search looks no farther than 30 m."""


class Reach(NamedTuple):
    """Standard deviations of keyframes as seen from one of them; 0 for that one."""

    distance: Array
    """(K,) m, in the direction in which it is greatest."""
    angle: Array
    """(K,) rad"""


def with_slips(relation: Pairwise, length: float, drift: float, drift_angle: float) -> Pairwise:
    """A relation of tracking over a way of `length` (m) that allows for slips it does not know of.

    `drift` and `drift_angle` are standard deviations in m/√m and rad/√m.
    """
    slips = np.diag([drift**2, drift**2, drift_angle**2]) * length
    covariance: Array = np.linalg.inv(relation.information) + slips
    return replace(relation, information=np.linalg.inv(covariance).astype(np.float64))


def seen_from(energy: GraphEnergy, poses: Array) -> Reach:
    """The marginals of the poses (K, 3) with the energy's fixed one held: relative to that one.

    As in marginal_covariances, the information is half the Hessian's Gauss–Newton part.
    """
    system = energy.evaluate(poses, exact=False)
    covariances = inverse_diagonal(factorise(energy.pattern, 0.5 * system.hessian))
    distance, angle = np.zeros(len(poses)), np.zeros(len(poses))
    distance[energy.free] = np.sqrt(np.linalg.eigvalsh(covariances[:, :2, :2])[:, 1])
    angle[energy.free] = np.sqrt(covariances[:, 2, 2])
    return Reach(distance, angle)


def at_most(energy: GraphEnergy, poses: Array) -> Reach:
    """As seen_from, of a part of a graph that may be in pieces: infinite where nothing holds a keyframe.

    What the rest of the graph knows besides makes the true values smaller, never larger.
    """
    system = energy.evaluate(poses, exact=False)
    factor = factorise(energy.pattern, 0.5 * system.hessian)
    held = ~loose_nodes(factor)
    covariances = inverse_diagonal(factor)[held]
    distance, angle = np.full(len(poses), np.inf), np.full(len(poses), np.inf)
    distance[energy.fixed] = angle[energy.fixed] = 0.0
    distance[energy.free[held]] = np.sqrt(np.linalg.eigvalsh(covariances[:, :2, :2])[:, 1])
    angle[energy.free[held]] = np.sqrt(covariances[:, 2, 2])
    return Reach(distance, angle)


class Whereabouts:
    """The reach of all keyframes from one that moves on, without asking the whole graph each time.

    Since it was asked, the way is added as if nothing but its own relations held it. That is never too
    little, and costs next to nothing.
    """

    def __init__(self) -> None:
        self._origin = 0
        self._reach = Reach(np.zeros(1), np.zeros(1))

    def ask(self, origin: int, energy: Callable[[int], GraphEnergy], poses: Array) -> Reach:
        """The reach (K,) from keyframe `origin`; `energy` gives the graph's with a keyframe held."""
        self._origin, self._reach = origin, seen_from(energy(origin), poses)
        return self._reach

    def narrow(self, origin: int, energy: Callable[[int, Indices], GraphEnergy], poses: Array) -> Reach:
        """A bound again, by what is known of the keyframes around alone; `origin` as last for `bound`.

        The same one where these are most of the graph: then it is as well to ask that.

        `energy` gives that of the graph of some keyframes (m,) with one of them held.
        """
        around = np.flatnonzero(np.hypot(*(poses[:, :2] - poses[origin, :2]).T) <= AROUND)
        if 2 * len(around) > len(poses):
            return self._reach
        local = at_most(energy(origin, around), poses[around])
        distance, angle = self._reach.distance.copy(), self._reach.angle.copy()
        distance[around] = np.minimum(distance[around], local.distance)
        angle[around] = np.minimum(angle[around], local.angle)
        self._reach = Reach(distance, angle)
        return self._reach

    def bound(self, origin: int, way: Sequence[Pairwise], poses: Array) -> Reach:
        """At most the reach from `origin`, of the keyframes before it; `way[k]` leads from k to k + 1.

        The origin never goes back.
        """
        known = len(self._reach.distance)
        distance, angle = np.zeros(len(poses)), np.zeros(len(poses))
        distance[:known], angle[:known] = self._reach.distance**2, self._reach.angle**2
        for step in range(self._origin, origin):
            covariance: Array = np.linalg.inv(way[step].information).astype(np.float64)
            distance[: step + 1] += _swung(covariance, way[step].measurement, poses[: step + 1], poses[step])
            angle[: step + 1] += covariance[2, 2]
        self._origin, self._reach = origin, Reach(np.sqrt(distance), np.sqrt(angle))
        return self._reach


def _swung(covariance: Array, measurement: Array, poses: Array, before: Array) -> Array:
    """The greatest variances (n,) of positions seen from the end of a relation, by what it is off.

    The relation begins at the pose `before` (3,); what lies v from its end, in its frame, moves by its shift
    and by its turn times v turned by a right angle.
    """
    v = relative(poses, before)[:, :2] - measurement[:2]
    by = np.zeros((len(v), 2, 3))
    by[:, 0, 0] = by[:, 1, 1] = 1.0
    by[:, 0, 2], by[:, 1, 2] = -v[:, 1], v[:, 0]
    spread: Array = by @ covariance @ by.transpose(0, 2, 1)
    return np.linalg.eigvalsh(spread)[:, 1].astype(np.float64)
