"""Chains of keyframes with relations of loops, made without scans."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.graph.model import NScan, Pairwise
from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.poses import Array, Indices, compose, relative
from nscan_cli.slam.loop_closure.relative_uncertainty import (
    RelativeSigma,
    held_pose_marginals,
)


def seen_from(energy: GraphEnergy, poses: Array) -> RelativeSigma:
    """From the energy's fixed keyframe."""
    return held_pose_marginals(energy, poses).sigma()


class Walk(NamedTuple):
    """A chain of keyframes, and relations of loops."""

    way: list[Pairwise]
    loops: list[Pairwise]
    nscan: list[NScan]
    poses: Array
    """(K, 3) at which all relations are fulfilled."""

    def energy(self, fixed: int) -> GraphEnergy:
        """The graph's, with a keyframe held."""
        size = len(self.poses)
        return GraphEnergy(size, [*self.way, *self.loops, *self.nscan], np.arange(size), fixed)

    def until(self, size: int) -> Walk:
        """The first keyframes only; the loops have to be among them."""
        return self._replace(way=self.way[: size - 1], poses=self.poses[:size])


def information(rng: np.random.Generator, size: int = 3) -> Array:
    """Of σ between 3 cm and 10 cm or 0.6° and 6°, the components of a pose correlated with each other."""
    root = rng.normal(0, 1, (size, size))
    scatter = root @ root.T + 0.3 * np.eye(size)
    correlation = scatter / np.sqrt(np.outer(np.diag(scatter), np.diag(scatter)))
    deviations = np.tile([1.0, 1.0, 0.3], size // 3) * rng.uniform(0.03, 0.1, size)
    return np.linalg.inv(correlation * np.outer(deviations, deviations)).astype(np.float64)


def walk(seed: int, size: int, loops: int, among: int | None = None) -> Walk:
    """Keyframes 1.5 m or so apart; loops `among` the first of them, or all: so many pairs, and triples."""
    rng = np.random.default_rng(seed)
    poses = np.zeros((size, 3))
    for k in range(1, size):
        poses[k] = compose(poses[k - 1], rng.normal([1.5, 0.0, 0.2], [0.1, 0.3, 0.5]))

    def pair(a: int, b: int) -> Pairwise:
        return Pairwise((a, b), relative(poses[b], poses[a]), information(rng), "loop")

    def three(nodes: Indices) -> NScan:
        local = relative(poses[nodes], np.array([1.0, 2.0, 0.5]))
        return NScan(tuple(nodes.tolist()), local, information(rng, 9), 1, "loop")

    way = [pair(k, k + 1) for k in range(size - 1)]
    chosen = [np.sort(rng.choice(among or size, 3, replace=False)) for _ in range(loops)]
    return Walk(way, [pair(*nodes[:2].tolist()) for nodes in chosen], [three(n) for n in chosen], poses)


def straight(count: int) -> Walk:
    """Keyframes 2 m apart on a line: σ of 0.1 m along, 0.2 m across and 0.1 rad from each to the next."""
    each = np.diag([1e2, 25.0, 1e2])
    way = [Pairwise((k, k + 1), np.array([2.0, 0, 0]), each, "track") for k in range(count - 1)]
    poses = np.zeros((count, 3))
    poses[:, 0] = 2.0 * np.arange(count)
    return Walk(way, [], [], poses)
