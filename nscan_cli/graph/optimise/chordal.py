"""Chordal initialisation, for graphs whose given poses are far from the minimum: rotations, then positions.

D. Martinec, T. Pajdla 2007; L. Carlone et al. 2015. With the rotation of pose i as the complex number
r_i = exp(i φ_i), a measured rotation asks for r_b = r_a exp(i θ_ab), which is linear in r. Once the rotations
are known, the problem is linear in the positions.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.graph.linalg.block_cholesky import factorise, solve
from nscan_cli.graph.linalg.factor_pattern import block_targets
from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.graph.optimise.graph_solver import newton_step
from nscan_cli.graph.optimise.term_cache import TermColumns
from nscan_cli.matching.damped_newton import GRAPH_STEPS
from nscan_cli.poses import Array, Indices

REGULARISATION = 1e-9
"""Lower bound of the information on a direction, as a share of the largest. It makes the systems regular."""


def chordal_start(energy: GraphEnergy, poses: Array) -> Array:
    """Poses (K, 3) from the relations alone; the fixed pose stays as it is in `poses`.

    Each relation gives the rotations from its pose c to its other poses, weighted by their marginals. The
    positions use the whole relation. The relations have to connect all poses.
    """
    start = np.zeros_like(poses)
    start[:, 2] = _rotations(energy, float(poses[energy.fixed, 2]))
    # With all positions equal, the translations have no derivative by the rotations, so that one Gauss–Newton
    # step finds the positions.
    system = energy.evaluate(start, exact=False)
    step = newton_step(energy.pattern, system)
    if step is None:
        step = newton_step(energy.pattern, system, GRAPH_STEPS.least_raised)
    if step is not None:
        start[energy.free] += step
    start[:, :2] += poses[energy.fixed, :2]
    return start


def _rotations(energy: GraphEnergy, angle: float) -> Array:
    """The angles (K,) that minimise Σ w |r_b − r_a exp(i θ_ab)|², with all r free but the fixed pose's."""
    a, b, turns, weights = _turns(energy.columns)
    weights = np.maximum(weights, REGULARISATION * (weights.max(initial=0.0) or 1.0))
    # r as (re, im, 0): blocks of three, which fit the energy's pattern.
    own = weights[:, None, None] * np.eye(3)
    turned = np.zeros_like(own)
    turned[:, 0, 0] = turned[:, 1, 1] = weights * np.cos(turns)
    turned[:, 1, 0] = weights * np.sin(turns)
    turned[:, 0, 1] = -turned[:, 1, 0]
    row, column = (energy.free_row[np.concatenate(nodes)] for nodes in ((a, b, b), (a, b, a)))
    targets = block_targets(np.stack([row, column], axis=1), energy.pattern)
    values = np.concatenate([own, own, -turned])
    values = np.where((targets & 1)[:, None, None] == 1, values.transpose(0, 2, 1), values)
    matrix = np.zeros((len(energy.pattern.rows), 3, 3))
    np.add.at(matrix, targets[targets >= 0] >> 1, values[targets >= 0])

    held = np.array([np.cos(angle), np.sin(angle), 0.0])
    right = np.zeros((len(energy.free_row), 3))
    np.add.at(right, b[a == energy.fixed], turned[a == energy.fixed] @ held)
    np.add.at(right, a[b == energy.fixed], held @ turned[b == energy.fixed])
    solved = solve(factorise(energy.pattern, matrix), right[energy.free])
    angles = np.full(len(energy.free_row), angle)
    angles[energy.free] = np.arctan2(solved[:, 1], solved[:, 0])
    return angles


def _turns(columns: TermColumns) -> tuple[Indices, Indices, Array, Array]:
    """The measured rotations θ_ab with their weights 1/σ²: (a, b, θ, w)."""
    nobody = np.zeros(0, dtype=np.int64)
    parts = [(nobody, nobody, np.zeros(0), np.zeros(0))]
    sizes = np.diff(columns.starts)
    for n in np.unique(sizes):
        chosen = np.flatnonzero(sizes == n)
        c = columns.fixed[chosen, None]
        others = np.arange(n - 1) + (np.arange(n - 1) >= c)
        first = columns.starts[chosen, None]
        H = columns.hessians[columns.hessian_starts[chosen, None] + np.arange(9 * n * n)]
        H *= columns.weights[chosen, None]
        free = (3 * others[:, :, None] + np.arange(3)).reshape(len(chosen), -1)
        kept = H.reshape(-1, 3 * n, 3 * n)[
            np.arange(len(chosen))[:, None, None], free[:, :, None], free[:, None]
        ]
        a = np.broadcast_to(columns.members[first + c], others.shape)
        turn = columns.local[first + others, 2] - columns.local[first + c, 2]
        weight = _marginal_weights(kept)
        parts.append((a.ravel(), columns.members[first + others].ravel(), turn.ravel(), weight.ravel()))
    a, b, turns, weights = (np.concatenate(column) for column in zip(*parts, strict=True))
    return a, b, turns, weights


def _marginal_weights(information: Array) -> Array:
    """1/σ² (R, m) of the angles of m poses, from their information (R, 3 m, 3 m)."""
    size = information.shape[1]
    largest = np.abs(information).max(axis=(1, 2), initial=0.0)[:, None, None]
    regular = information + REGULARISATION * np.where(largest > 0, largest, 1.0) * np.eye(size)
    return 1 / np.diagonal(np.linalg.inv(regular), axis1=1, axis2=2)[:, 2::3]
