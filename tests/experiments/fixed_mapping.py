"""Graphs minimised with a mapping to local coordinates that is fixed in each iteration (paper, IV).

With a fixed mapping f has simple derivatives; the next iteration computes the mapping again. For comparison,
the same steps are done with the mapping of the package, which depends on the poses.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from scipy.sparse import csr_array

from nscan_cli.graph.linalg.factor_pattern import Pattern, block_targets
from nscan_cli.graph.model import NScan, Pairwise
from nscan_cli.graph.optimise.graph_energy import GraphEnergy, System
from nscan_cli.graph.optimise.graph_solver import Optimum, newton_step
from nscan_cli.matching.damped_newton import GRAPH_STEPS, is_accepted, is_last, next_damping
from nscan_cli.poses import Array, Indices
from tests.experiments.mappings import Mapping, Relations, differences, grouped

MAX_ITERATIONS, TOLERANCE = 200, 1e-6


class IteratedEnergy(Protocol):
    """An energy whose function changes from iteration to iteration."""

    pattern: Pattern
    free: Indices

    def mappings_at(self, poses: Array) -> list[Array]:
        """The mappings for the iteration that starts at the poses (K, 3)."""

    def evaluate_with(self, poses: Array, held: list[Array]) -> System:
        """The function with these mappings, and the Gauss–Newton part of its Hessian."""

    def value_with(self, poses: Array, held: list[Array]) -> float:
        """The value of the function with these mappings."""


class VariableMapping(GraphEnergy):
    """The mapping of the package, which depends on the poses."""

    def mappings_at(self, poses: Array) -> list[Array]:
        return []

    def evaluate_with(self, poses: Array, held: list[Array]) -> System:
        return self.evaluate(poses, exact=False)

    def value_with(self, poses: Array, held: list[Array]) -> float:
        return self.evaluate(poses, exact=False).value


class FixedMapping(GraphEnergy):
    """The mapping of every nScan relation is fixed in each iteration."""

    def __init__(
        self,
        nodes: int,
        pairwise: Sequence[Pairwise],
        nscan: Sequence[NScan],
        positions: Indices,
        mapping: Mapping,
    ) -> None:
        # Relations without information reserve their blocks in the pattern.
        empty = [dataclasses.replace(each, hessian=np.zeros_like(each.hessian)) for each in nscan]
        super().__init__(nodes, [*pairwise, *empty], positions)
        self.mapping = mapping
        self.groups = [(group, *self._lower(group)) for group in grouped(nscan, positions)]

    def _lower(self, group: Relations) -> tuple[Array, csr_array[np.float64]]:
        """The blocks (Q, T, 3, 3) of the lower triangles of H, and what adds them to the factor."""
        count, n = group.members.shape
        i, j = np.tril_indices(n)
        blocks = group.hessians.reshape(count, n, 3, n, 3)[:, i, :, j].swapaxes(0, 1)
        edges = self.free_row[np.stack([group.members[:, i], group.members[:, j]], axis=-1)]
        targets = block_targets(edges.reshape(-1, 2), self.pattern).reshape(count, -1)
        transposed = (targets >= 0) & (targets & 1 == 1)
        blocks[transposed] = blocks[transposed].swapaxes(1, 2)
        chosen = np.flatnonzero(targets >= 0)
        places = (targets.ravel()[chosen] >> 1, chosen)
        add = csr_array((np.ones(len(chosen)), places), shape=(len(self.pattern.rows), targets.size))
        return blocks, add

    def mappings_at(self, poses: Array) -> list[Array]:
        return [self.mapping(group, poses[group.members]) for group, _, _ in self.groups]

    def value_with(self, poses: Array, held: list[Array]) -> float:
        value = self.evaluate(poses, exact=False).value
        for (group, _, _), mapping in zip(self.groups, held, strict=True):
            f = differences(group, poses[group.members], mapping).reshape(len(mapping), -1, 1)
            value += float((f * (group.hessians @ f)).sum())
        return value

    def evaluate_with(self, poses: Array, held: list[Array]) -> System:
        value, terms, gradient, hessian = self.evaluate(poses, exact=False)
        pulls = np.zeros_like(poses)
        for (group, blocks, add), mapping in zip(self.groups, held, strict=True):
            f = differences(group, poses[group.members], mapping)
            pull = (group.hessians @ f.reshape(len(f), -1, 1)).reshape(f.shape)
            value += float((f * pull).sum())
            turn = np.tile(np.eye(3), (len(f), 1, 1))
            turn[:, 0, 0] = turn[:, 1, 1] = np.cos(mapping[:, 2])
            turn[:, 1, 0] = np.sin(mapping[:, 2])
            turn[:, 0, 1] = -turn[:, 1, 0]
            np.add.at(pulls, group.members, 2 * pull @ turn)
            turned = turn.swapaxes(1, 2)[:, None] @ blocks @ turn[:, None]
            added = np.asarray(add @ turned.reshape(-1, 9))
            hessian += 2 * added.reshape(-1, 3, 3)
        return System(value, terms, gradient + pulls[self.free], hessian)


def minimise(energy: IteratedEnergy, poses: Array, max_iterations: int = MAX_ITERATIONS) -> Optimum:
    """As graph_solver.optimise, for a function that changes from iteration to iteration.

    A step is accepted when it lowers the function of its own iteration.
    """
    held = energy.mappings_at(poses)
    here, damping, iteration = energy.evaluate_with(poses, held), GRAPH_STEPS.first, 0
    for iteration in range(1, max_iterations + 1):
        step, accepted = newton_step(energy.pattern, here, damping), False
        if step is not None:
            trial = poses.copy()
            trial[energy.free] += step
            length = float(np.abs(step).max(initial=0.0))
            accepted = is_accepted(here.value, energy.value_with(trial, held), GRAPH_STEPS)
            if accepted:
                poses, held = trial, energy.mappings_at(trial)
                here = energy.evaluate_with(poses, held)
            if is_last(length, TOLERANCE, damping, GRAPH_STEPS):
                return Optimum(poses, here.value, iteration, True)
        damping = next_damping(damping, accepted, GRAPH_STEPS)
        if damping > GRAPH_STEPS.greatest:
            break
    return Optimum(poses, here.value, iteration, False)
