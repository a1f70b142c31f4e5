"""Relations between known poses, exact or with noise of the covariance that they state."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from nscan_cli.graph.model import Graph, NScan, Pairwise
from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.poses import Array, compose, relative, relative_jacobians

SIGMA = np.array([0.05, 0.03, 0.01])
"""m, m, rad"""


def ring(count: int, radius: float = 10.0) -> Array:
    """Poses (count, 3) around a circle, each looking ahead; the first at (radius, 0)."""
    angle = 2 * np.pi * np.arange(count) / count
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), angle + np.pi / 2], axis=1)


def ring_edges(count: int) -> list[tuple[int, int]]:
    """Each pose to the next, and the last to the first."""
    return [(i, (i + 1) % count) for i in range(count)]


def random_information(rng: np.random.Generator) -> Array:
    """(3, 3) with standard deviations about SIGMA, and correlations."""
    root = np.eye(3) + 0.3 * rng.normal(size=(3, 3))
    return root @ root.T / np.outer(SIGMA, SIGMA)


def pairwise_relations(
    truth: Array, edges: Iterable[tuple[int, int]], rng: np.random.Generator, noise: float = 0.0
) -> list[Pairwise]:
    """A relation an edge; `noise` 1 adds noise of the covariance that the relation states."""
    relations = []
    for a, b in edges:
        information = random_information(rng)
        error = noise * np.linalg.solve(np.linalg.cholesky(information).T, rng.normal(size=3))
        relations.append(Pairwise((a, b), relative(truth[b], truth[a]) + error, information, "loop"))
    return relations


def nscan_relation(
    truth: Array, members: Sequence[int], rng: np.random.Generator, noise: float = 0.0
) -> NScan:
    """The members matched in all pairs, in a frame of their own; c is any of them."""
    n = len(members)
    local = relative(truth[list(members)], rng.normal(size=3))
    H = np.zeros((3 * n, 3 * n))
    for i in range(n):
        for j in range(i):
            J = np.zeros((3, 3 * n))
            J[:, 3 * i : 3 * i + 3], J[:, 3 * j : 3 * j + 3] = relative_jacobians(local[i], local[j])
            H += J.T @ random_information(rng) @ J / (n - 1)
    eigenvalues, vectors = np.linalg.eigh(H)
    # The three smallest are the gauge's zeros.
    error = vectors[:, 3:] @ (rng.normal(size=3 * n - 3) / np.sqrt(eigenvalues[3:]))
    return NScan(tuple(members), local + noise * error.reshape(n, 3), H, int(rng.integers(n)), "nscan")


def mixed_ring(
    count: int, noise: float, seed: int = 0, radius: float = 10.0
) -> tuple[Array, list[Pairwise], list[NScan]]:
    """A ring half of pairwise relations, half of nScan relations of four poses, with some overlap."""
    rng = np.random.default_rng(seed)
    truth = ring(count, radius)
    half = count // 2
    pairwise = pairwise_relations(truth, ring_edges(count)[: half + 1], rng, noise)
    starts = range(half, count, 2)
    nscan = [nscan_relation(truth, [(s + i) % count for i in range(4)], rng, noise) for s in starts]
    return truth, pairwise, nscan


def graph_of(poses: Array, pairwise: list[Pairwise], nscan: list[NScan]) -> Graph:
    """A graph whose nodes are all keyframes."""
    count = len(poses)
    return Graph(
        scans=np.arange(count),
        stamps=[str(i) for i in range(count)],
        poses=poses.copy(),
        odometry=None,
        anchors=np.arange(count),
        pairwise=pairwise,
        nscan=nscan,
    )


def energy_of(poses: Array, pairwise: list[Pairwise], nscan: list[NScan], fixed: int = 0) -> GraphEnergy:
    """The energy of a graph whose ids are its places."""
    return GraphEnergy(len(poses), [*pairwise, *nscan], np.arange(len(poses)), fixed)


def each_pair_once(pairwise: list[Pairwise], nscan: list[NScan]) -> tuple[list[Pairwise], list[NScan]]:
    """The relations as marginals weigh them: by the mean of 1 / m over their pairs of nodes.

    m is in how many relations a pair is: for a pairwise one, itself and the nScan ones.
    """

    def among(pair: Sequence[int], relations: Sequence[Pairwise | NScan]) -> int:
        return sum(set(pair) <= set(relation.nodes) for relation in relations)

    def share(relation: NScan) -> float:
        both: list[Pairwise | NScan] = [*nscan, *pairwise]
        return float(np.mean([1.0 / among(pair, both) for pair in combinations(relation.nodes, 2)]))

    return (
        [replace(r, information=r.information / (1 + among(r.nodes, nscan))) for r in pairwise],
        [replace(r, hessian=r.hessian * share(r)) for r in nscan],
    )


def disturbed(poses: Array, by: float, seed: int = 1) -> Array:
    """The poses with noise of `by` (m) and a tenth of it (rad); the first one stays."""
    noise = by * np.random.default_rng(seed).normal(size=poses.shape) * [1, 1, 0.1]
    noise[0] = 0
    return compose(poses, noise)


def dense_matrix(energy: GraphEnergy, blocks: Array) -> Array:
    """The matrix (3 F, 3 F) of the free poses in their order, from the blocks of its lower triangle."""
    pattern = energy.pattern
    nodes = len(pattern.place)
    order = np.argsort(pattern.place)
    matrix = np.zeros((nodes, 3, nodes, 3))
    for column in range(nodes):
        for block in range(pattern.starts[column], pattern.starts[column + 1]):
            a, b = order[pattern.rows[block]], order[column]
            matrix[b, :, a, :] = blocks[block].T
            matrix[a, :, b, :] = blocks[block]
    return matrix.reshape(3 * nodes, 3 * nodes)


def streets(count: int, loops: int, turn_noise: float, seed: int) -> tuple[Array, list[Pairwise]]:
    """A walk (count, 3) through the streets of a town, 1 m a step, and what is measured on the way.

    At every fifth step it may turn. `loops` relations lead to places next to it that it came by before;
    noise is 0.1 m, and `turn_noise` (rad) of every turn.
    """
    rng = np.random.default_rng(seed)
    half, poses = 0.3 * np.sqrt(count), [np.zeros(3)]
    while len(poses) < count:
        turn = rng.choice([-1, 0, 1]) if len(poses) % 5 == 0 else 0
        ahead = compose(poses[-1], np.array([1.0, 0.0, turn * np.pi / 2]))
        inside = np.abs(ahead[:2]).max() <= half
        poses.append(ahead if inside else compose(poses[-1], np.array([0.0, 0.0, np.pi / 2])))
    truth = np.array(poses)
    away = np.abs(truth[:, None, :2] - truth[None, :, :2]).max(axis=2)
    again = np.argwhere((away < 1.5) & (np.arange(count)[:, None] - np.arange(count) > 10))[:, ::-1]
    edges = [(k, k + 1) for k in range(count - 1)]
    edges += [(int(a), int(b)) for a, b in rng.permutation(again)[:loops]]
    sigma = np.array([0.1, 0.1, turn_noise])
    relations = [
        Pairwise(
            (a, b), relative(truth[b], truth[a]) + sigma * rng.normal(size=3), np.diag(sigma**-2), "loop"
        )
        for a, b in edges
    ]
    return truth, relations
