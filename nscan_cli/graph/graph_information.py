"""What the relations of a graph together say of its keyframes: half the Hessian, every pair counted once.

Relations that share a pair of scans share the noise of its match. Where they overlap, each is a measurement,
and the optimum of all is as good as they say; but the more there are of one pair, the less they know by
themselves. So that the covariance does not shrink with their number, each is weighed by how many its pairs
take part in.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from nscan_cli.graph.linalg.block_cholesky import Factor, factorise
from nscan_cli.graph.model import Graph, NScan, Pairwise
from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.graph.optimise.whole_graph import Component
from nscan_cli.graph.relations.base import Relation
from nscan_cli.poses import Array


def component_information(graph: Graph, part: Component) -> tuple[GraphEnergy, Factor]:
    """The energy of a part of the graph, and the factor of its information at the graph's poses.

    The energies (17) and (23) have no ½, so the information is half their Hessian; its Gauss–Newton part
    is taken. The part's first keyframe is held.
    """
    energy = part.energy(len(graph)).weighted(_each_pair_once(part.relations))
    system = energy.evaluate(graph.poses[part.keyframes], exact=False)
    return energy, factorise(energy.pattern, 0.5 * system.hessian)


def _each_pair_once(relations: Sequence[Relation]) -> Array:
    """The weights (R,) of the relations: 1/m, of how many a pair of scans is in on the (harmonic) average.

    Pairwise relations by themselves are measured apart from each other. To joint matches they are priors:
    what they say is in H already. What relations of further types say is not of scans, and counts whole.
    """
    of_scans = [k for k, relation in enumerate(relations) if isinstance(relation, NScan | Pairwise)]
    pairs = [_pair_keys(relations[k].nodes) for k in of_scans]
    sizes = [len(each) for each in pairs]
    is_joint = np.repeat([isinstance(relations[k], NScan) for k in of_scans], sizes).astype(np.bool_)
    _, places = np.unique(np.concatenate([_pair_keys(()), *pairs]), return_inverse=True)
    of_joint, of_any = np.bincount(places[is_joint], minlength=len(places)), np.bincount(places)
    counts = np.where(is_joint, of_any[places], of_joint[places] + 1)
    owners = np.repeat(np.arange(len(sizes)), sizes)
    weights = np.ones(len(relations))
    weights[of_scans] = np.bincount(owners, 1.0 / counts, minlength=len(sizes)) / sizes
    return weights


def _pair_keys(nodes: Sequence[int]) -> NDArray[np.int64]:
    """(n (n − 1) / 2,) the pairs of n nodes, each as one number."""
    ordered = np.sort(np.array(nodes, dtype=np.int64))
    a, b = _all_pairs(len(ordered))
    pairs: NDArray[np.int64] = ordered[a] << 32 | ordered[b]
    return pairs


@functools.cache
def _all_pairs(n: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    return np.triu_indices(n, 1)
