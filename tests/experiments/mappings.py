"""Mappings from global to local coordinates of nScan relations, fixed in an iteration (paper, IV)."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from nscan_cli.graph.model import NScan
from nscan_cli.poses import Array, Indices, compose, inverse, wrap

GRID = np.linspace(-np.pi, np.pi, 361)
"""Angles, from the mean one, among which the optimal one is sought."""
BISECTIONS = 30
LEAST_SHARE = 1e-9
"""Share of the greatest entry of H that holds a shift without information in H."""


class Relations(NamedTuple):
    """Q nScan relations of n scans each."""

    members: Indices
    """(Q, n) places of the poses."""
    local: Array
    """(Q, n, 3), shifted so that the mean of the positions is 0."""
    hessians: Array
    """(Q, 3 n, 3 n)"""
    fixed: Indices
    """(Q,) pose c."""


Mapping = Callable[[Relations, Array], Array]
"""The transformation T (Q, 3) from global to local coordinates, with the poses (Q, n, 3) of the scans."""


def of_pose_c(relations: Relations, poses: Array) -> Array:
    """The one that maps pose c to where it is locally."""
    c = np.arange(len(poses)), relations.fixed
    return compose(relations.local[c], inverse(poses[c]))


def mean(relations: Relations, poses: Array) -> Array:
    """The mean of those that map one scan each: of the angles, and then of the shifts."""
    turns = np.exp(1j * (relations.local[..., 2] - poses[..., 2])).mean(axis=1)
    mapping = np.zeros((len(poses), 3))
    mapping[:, 2] = np.angle(turns)
    mapping[:, :2] = (relations.local - compose(mapping[:, None], poses))[..., :2].mean(axis=1)
    return mapping


def optimal(relations: Relations, poses: Array) -> Array:
    """The one that makes fᵗHf least.

    With δ from the mean angle f = (cos δ − 1) u + (sin δ − δ) v + δ w + f₀ + a shift: u are the positions,
    v the same turned by 90°, w is a turn of all poses. The best shift is linear in these four.
    """
    first = mean(relations, poses)
    count, n = relations.members.shape
    start = differences(relations, poses, first)
    u, v, w = np.zeros((3, *start.shape))
    u[..., :2] = start[..., :2] + relations.local[..., :2]
    v[..., 0], v[..., 1] = -u[..., 1], u[..., 0]
    w[..., :2], w[..., 2] = v[..., :2], 1.0
    parts = np.stack([u, v, w, start], axis=-1).reshape(count, 3 * n, 4)

    shifts = np.tile(np.eye(3)[:, :2], (n, 1))
    pull = shifts.T @ relations.hessians
    least = LEAST_SHARE * np.abs(relations.hessians).max(axis=(1, 2))
    shift = -np.linalg.solve(pull @ shifts + least[:, None, None] * np.eye(2), pull @ parts)
    parts += shifts @ shift
    gram = parts.transpose(0, 2, 1) @ relations.hessians @ parts

    factors = _factors(GRID)[0]
    products = (factors[:, :, None] * factors[:, None]).reshape(-1, 16)
    # Not as a product of matrices: BLAS would start threads for it, which costs more on a busy machine.
    lowest = GRID[np.einsum("qa,ka->qk", gram.reshape(-1, 16), products).argmin(axis=1)]
    low, high = lowest - (GRID[1] - GRID[0]), lowest + (GRID[1] - GRID[0])
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        factors, slopes = _factors(middle)
        rises = np.einsum("qa,qab,qb->q", slopes, gram, factors) > 0
        low, high = np.where(rises, low, middle), np.where(rises, middle, high)
    turned = np.stack([*(shift @ _factors(low)[0][:, :, None])[..., 0].T, low], axis=-1)
    return compose(turned, first)


def _factors(turn: Array) -> tuple[Array, Array]:
    """What u, v, w and f₀ are multiplied with (…, 4), and its derivative."""
    one = np.ones_like(turn)
    factors = np.stack([np.cos(turn) - 1, np.sin(turn) - turn, turn, one], axis=-1)
    return factors, np.stack([-np.sin(turn), np.cos(turn) - 1, one, 0 * one], axis=-1)


def differences(relations: Relations, poses: Array, mapping: Array) -> Array:
    """f (Q, n, 3)."""
    f = compose(mapping[:, None], poses) - relations.local
    f[..., 2] = wrap(f[..., 2])
    return f


def grouped(nscan: Sequence[NScan], positions: Indices) -> list[Relations]:
    """The relations by the number of their scans."""
    groups = []
    for n in sorted({len(relation.nodes) for relation in nscan}):
        chosen = [relation for relation in nscan if len(relation.nodes) == n]
        local = np.array([relation.poses for relation in chosen])
        local[..., :2] -= local[..., :2].mean(axis=1, keepdims=True)
        members = positions[np.array([relation.nodes for relation in chosen])]
        hessians = np.array([relation.hessian for relation in chosen])
        groups.append(Relations(members, local, hessians, np.array([each.fixed for each in chosen])))
    return groups


def with_c_held(relation: NScan) -> NScan:
    """The relation with the Hessian for a fixed pose c: zeros in the rows and columns of c."""
    hessian = relation.hessian.copy()
    rows = slice(3 * relation.fixed, 3 * relation.fixed + 3)
    hessian[rows] = hessian[:, rows] = 0.0
    return dataclasses.replace(relation, hessian=hessian)
