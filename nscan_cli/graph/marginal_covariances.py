"""Marginal covariances of the keyframes' global poses, from the information of a graph (paper, III-D, IV).

The information is half the Hessian of the relations, with each pair of scans counted once. Relations that
share a pair of scans share the noise of its match, so they are not independent. Each relation is weighted by
one over the number of relations that its pairs take part in: the covariance does not shrink with the number
of relations of one pair.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nscan_cli.graph.io.symmetric_matrices import upper_indices
from nscan_cli.graph.linalg.block_cholesky import Factor, factorise, undetermined_nodes
from nscan_cli.graph.linalg.selected_inverse import inverse_diagonal
from nscan_cli.graph.model import Graph
from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.graph.optimise.whole_graph import Component, components
from nscan_cli.graph.relations.base import Relation
from nscan_cli.graph.relations.registry import is_joint, is_pairwise
from nscan_cli.poses import Array, Indices


def component_information(graph: Graph, component: Component) -> tuple[GraphEnergy, Factor]:
    """The energy of a component, and the factor of its information at the graph's poses.

    The energies (17) and (23) have no factor ½, so the information is half the Gauss–Newton part of their
    Hessian. The component's first keyframe is fixed.
    """
    energy = component.energy(len(graph)).weighted(_each_pair_once(component.relations))
    system = energy.evaluate(graph.poses[component.keyframes], exact=False)
    return energy, factorise(energy.pattern, 0.5 * system.hessian)


def _each_pair_once(relations: Sequence[Relation]) -> Array:
    """The weights (R,) of the relations: 1/m, with m the harmonic mean of the relations per pair of scans.

    Pairwise relations are independent of each other. Joint matches take them as priors, so H contains their
    information. Relations of other types do not come from scans, and have weight 1.
    """
    of_scans = [k for k, relation in enumerate(relations) if is_joint(relation) or is_pairwise(relation)]
    pairs = [_pair_keys(relations[k].nodes) for k in of_scans]
    sizes = [len(each) for each in pairs]
    joint = np.repeat([is_joint(relations[k]) for k in of_scans], sizes).astype(np.bool_)
    _, places = np.unique(np.concatenate([_pair_keys(()), *pairs]), return_inverse=True)
    of_joint, of_any = np.bincount(places[joint], minlength=len(places)), np.bincount(places)
    counts = np.where(joint, of_any[places], of_joint[places] + 1)
    owners = np.repeat(np.arange(len(sizes)), sizes)
    weights = np.ones(len(relations))
    weights[of_scans] = np.bincount(owners, 1.0 / counts, minlength=len(sizes)) / sizes
    return weights


def _pair_keys(nodes: Sequence[int]) -> Indices:
    """(n (n − 1) / 2,) the pairs of n nodes, each packed into one integer."""
    ordered = np.sort(np.array(nodes, dtype=np.int64))
    a, b = upper_indices(len(ordered), 1)
    return ordered[a] << 32 | ordered[b]


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
    known = zip(others[~undetermined].tolist(), covariances[~undetermined], strict=True)
    return {first: np.zeros((3, 3)), **dict(known)}
