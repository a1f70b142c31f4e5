"""Marginal covariances of the keyframes' global poses (paper, III-D, IV)."""

from __future__ import annotations

import numpy as np

from nscan_cli.graph.graph_information import component_information
from nscan_cli.graph.linalg.block_cholesky import undetermined_nodes
from nscan_cli.graph.linalg.selected_inverse import inverse_diagonal
from nscan_cli.graph.model import Graph
from nscan_cli.graph.optimise.whole_graph import components
from nscan_cli.poses import Array


def marginal_covariances(graph: Graph) -> dict[int, Array]:
    """Keyframe id → covariance (3, 3) of its global pose (x, y, φ), with the first keyframe fixed.

    The first keyframe gets zeros. A keyframe is left out where no relations connect it to the first one, or
    where they leave one of its directions undetermined.
    """
    part = components(graph)[0]
    first, others = int(part.keyframes[0]), part.keyframes[1:]
    _, factor = component_information(graph, part)
    covariances = inverse_diagonal(factor)
    undetermined = undetermined_nodes(factor)
    marginals = {first: np.zeros((3, 3))}
    for keyframe, covariance, is_open in zip(others.tolist(), covariances, undetermined, strict=True):
        if not is_open:
            marginals[keyframe] = covariance
    return marginals
