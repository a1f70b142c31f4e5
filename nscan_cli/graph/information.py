"""What the relations of a graph together say of its keyframes: half the Hessian, every scan counted once.

Relations that share a scan share its noise. Where they overlap, each is a measurement, and the optimum of all
is as good as they say; but the more there are of one scan, the less they know by themselves. So that the
covariance does not shrink with their number, each is weighed by how many its scans take part in.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from nscan_cli.graph.cholesky import Factor, factorise
from nscan_cli.graph.model import Graph
from nscan_cli.graph.solve import Component
from nscan_cli.graph.system import GraphEnergy


def information(graph: Graph, part: Component) -> tuple[GraphEnergy, Factor]:
    """The energy of a part of the graph, and the factor of its information at the graph's poses.

    The energies (17) and (23) have no ½, so the information is half their Hessian; its Gauss–Newton part
    is taken. The part's first keyframe is held.
    """
    energy = _each_scan_once(part).energy(len(graph))
    system = energy.evaluate(graph.poses[part.keyframes], exact=False)
    return energy, factorise(energy.pattern, 0.5 * system.hessian)


def _each_scan_once(part: Component) -> Component:
    """The relations with their information divided by m, of how many a scan is on the (harmonic) average.

    Pairwise relations by themselves are measured apart from each other. To joint matches they are priors:
    what they say is in H already.
    """
    joint = Counter(node for relation in part.nscan for node in relation.nodes)
    either = joint + Counter(node for relation in part.pairwise for node in relation.nodes)
    pairwise = [
        replace(relation, information=relation.information * _mean_share(joint, relation.nodes, 1))
        for relation in part.pairwise
    ]
    nscan = [
        replace(relation, hessian=relation.hessian * _mean_share(either, relation.nodes, 0))
        for relation in part.nscan
    ]
    return replace(part, pairwise=pairwise, nscan=nscan)


def _mean_share(count: Counter[int], nodes: tuple[int, ...], itself: int) -> float:
    return float(np.mean([1.0 / (count[node] + itself) for node in nodes]))
