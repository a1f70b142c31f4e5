"""What the relations of a graph together say of its keyframes: half the Hessian, every scan counted once.

Relations that share a scan share its noise. Where they overlap, each is a measurement, and the optimum of all
is as good as they say; but the more there are of one scan, the less they know by themselves. So that the
covariance does not shrink with their number, each is weighed by how many its scans take part in.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from nscan_cli.graph.cholesky import Factor, factorise
from nscan_cli.graph.model import Graph, NScan, Pairwise
from nscan_cli.graph.relation import Relation
from nscan_cli.graph.solve import Component
from nscan_cli.graph.system import GraphEnergy
from nscan_cli.poses import Array


def information(graph: Graph, part: Component) -> tuple[GraphEnergy, Factor]:
    """The energy of a part of the graph, and the factor of its information at the graph's poses.

    The energies (17) and (23) have no ½, so the information is half their Hessian; its Gauss–Newton part
    is taken. The part's first keyframe is held.
    """
    energy = part.energy(len(graph)).weighted(_each_scan_once(part.relations))
    system = energy.evaluate(graph.poses[part.keyframes], exact=False)
    return energy, factorise(energy.pattern, 0.5 * system.hessian)


def _each_scan_once(relations: Sequence[Relation]) -> Array:
    """The weights (R,) of the relations: 1/m, of how many a scan is on the (harmonic) average.

    Pairwise relations by themselves are measured apart from each other. To joint matches they are priors:
    what they say is in H already. What relations of further types say is not of scans, and counts whole.
    """
    joint = Counter(node for each in relations if isinstance(each, NScan) for node in each.nodes)
    either = joint + Counter(node for each in relations if isinstance(each, Pairwise) for node in each.nodes)
    weights = np.ones(len(relations))
    for k, relation in enumerate(relations):
        if isinstance(relation, NScan):
            weights[k] = np.mean([1.0 / either[node] for node in relation.nodes])
        elif isinstance(relation, Pairwise):
            weights[k] = np.mean([1.0 / (joint[node] + 1) for node in relation.nodes])
    return weights
