"""The marginal of the relative pose of two nodes of a graph."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nscan_cli.graph.linalg.block_cholesky import solve, undetermined_nodes
from nscan_cli.graph.marginal_covariances import component_information
from nscan_cli.graph.model import Graph, Pairwise
from nscan_cli.graph.optimise.whole_graph import Component, components
from nscan_cli.poses import Array, relative, relative_jacobians


class AttachmentOptions(NamedTuple):
    """How certain a scan that is no keyframe is in the frame of its keyframe, where the graph measures
    nothing."""

    sigma: float = 0.05
    """Standard deviation of its position along each axis, m. A larger value makes relations of such scans
    less certain."""
    angle_sigma: float = 0.05
    """Standard deviation of its heading, rad. A larger value makes relations of such scans less certain."""


class RelativePoses:
    """The relative poses of some nodes of a graph at its optimum, with their covariances."""

    def __init__(
        self, graph: Graph, nodes: Sequence[int], attachment: AttachmentOptions = AttachmentOptions()
    ) -> None:
        self._graph, self._attachment = graph, attachment
        anchors = set(graph.anchors[list(nodes)].tolist())
        self._components: list[tuple[list[int], Array]] = []
        for part in components(graph):
            chosen = [int(keyframe) for keyframe in part.keyframes if int(keyframe) in anchors]
            if chosen:
                self._components.append(_joint_covariance(graph, part, chosen))

    def relation(self, a: int, b: int) -> Pairwise | None:
        """The pose of node b in the frame of node a, with its information from all relations of the graph.

        A node that is no keyframe moves with its keyframe, as far as `attachment` says. None if no relations
        lead from one node to the other, or if they leave a direction open.
        """
        graph, nodes = self._graph, (a, b)
        anchors = [int(graph.anchors[node]) for node in nodes]
        part = next((part for part in self._components if set(anchors) <= set(part[0])), None)
        if part is None:
            return None
        chosen, covariance = part
        by_b, by_a = relative_jacobians(graph.poses[b], graph.poses[a])
        jacobian = np.zeros((3, len(covariance)))
        for by, node, anchor in zip((by_a, by_b), nodes, anchors, strict=True):
            at = 3 * chosen.index(anchor)
            jacobian[:, at : at + 3] += by @ _rigid_jacobian(graph.poses[node] - graph.poses[anchor])
        spread = sum(node != anchor for node, anchor in zip(nodes, anchors, strict=True))
        sigma, angle_sigma = self._attachment
        own = spread * np.diag([sigma**2, sigma**2, angle_sigma**2])
        relative_covariance = jacobian @ covariance @ jacobian.T + own
        measurement = relative(graph.poses[b], graph.poses[a])
        return Pairwise((a, b), measurement, np.linalg.inv(relative_covariance), "track")


def _joint_covariance(graph: Graph, part: Component, chosen: list[int]) -> tuple[list[int], Array]:
    """The chosen keyframes (m,) that are determined, and the covariance (3m, 3m) of their poses.

    The component's first keyframe is fixed, which does not affect relative poses.
    """
    energy, factor = component_information(graph, part)
    undetermined = undetermined_nodes(factor)
    rows = energy.free_row[np.searchsorted(part.keyframes, chosen)]
    known = [at for at, row in enumerate(rows) if row < 0 or not undetermined[row]]
    covariance = np.zeros((len(known), 3, len(known), 3))
    free = [at for at, k in enumerate(known) if rows[k] >= 0]
    for at in free:
        for component in range(3):
            unit = np.zeros((len(undetermined), 3))
            unit[rows[known[at]], component] = 1.0
            covariance[free, :, at, component] = solve(factor, unit)[rows[known][free]]
    return [chosen[at] for at in known], covariance.reshape(3 * len(known), 3 * len(known))


def _rigid_jacobian(offset: Array) -> Array:
    """∂p/∂a (3, 3) of a pose p that moves rigidly with a, where p − a = offset."""
    return np.array([[1.0, 0.0, -offset[1]], [0.0, 1.0, offset[0]], [0.0, 0.0, 1.0]])
