"""A graph in a frame that is turned about the origin."""

from __future__ import annotations

import dataclasses

import numpy as np

from nscan_cli.graph.model import Graph
from nscan_cli.poses import compose, rotated_information


def turned_graph(graph: Graph, turn: float) -> Graph:
    """The graph turned by an angle (rad) about the origin. Its relations are relative and stay."""
    frame = np.array([0.0, 0.0, turn])
    return dataclasses.replace(
        graph,
        poses=compose(np.broadcast_to(frame, graph.poses.shape), graph.poses),
        marginals={node: rotated_information(frame, cov) for node, cov in graph.marginals.items()},
    )
