"""A graph in a frame that is turned about the origin."""

from __future__ import annotations

import dataclasses

import numpy as np

from nscan_cli.graph.model import Graph
from nscan_cli.poses import compose


def turned_graph(graph: Graph, turn: float) -> Graph:
    """The graph turned by an angle (rad) about the origin. Its relations are relative and stay."""
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    frame = np.array([0.0, 0.0, turn])
    return dataclasses.replace(
        graph,
        poses=compose(np.broadcast_to(frame, graph.poses.shape), graph.poses),
        marginals={node: rotation @ cov @ rotation.T for node, cov in graph.marginals.items()},
    )
