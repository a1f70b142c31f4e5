"""Step 5: rejection of loops that contradict the graph, as graph/optimise/graduated_nonconvexity.py finds."""

from __future__ import annotations

import dataclasses

import numpy as np

from nscan_cli.graph.optimise.graduated_nonconvexity import contradicting
from nscan_cli.graph.relations.registry import centre_of
from nscan_cli.slam.backend.degenerate_relations import all_widened_relations
from nscan_cli.slam.backend.optimisation import optimise
from nscan_cli.slam.state import SlamState

CONTRADICTS = "contradicts the rest of the graph"


def reject_contradicting_loops(state: SlamState) -> None:
    """Remove the relations of loops that contradict the others. Changes relations, loops, route, schedule."""
    relations = state.relations
    # These are in the same order.
    energy = state.energies.of(state.route, all_widened_relations(state))
    closes_loop = np.array([relation.origin == "loop" for relation in relations], dtype=np.bool_)
    wrong = contradicting(energy, state.poses, closes_loop, state.options.rejection)
    if not wrong.any():
        return
    rejected = [relation for relation, is_wrong in zip(relations, wrong, strict=True) if is_wrong]
    gone = {id(relation) for relation in rejected}
    state.matched_pairs = [pair for pair in state.matched_pairs if id(pair) not in gone]
    state.nscan_relations = [joint for joint in state.nscan_relations if id(joint) not in gone]
    state.other_relations = [other for other in state.other_relations if id(other) not in gone]
    centres = {centre_of(relation) for relation in rejected}
    state.loops = [
        dataclasses.replace(loop, accepted=False, reason=CONTRADICTS)
        if loop.accepted and loop.nodes[1] in centres
        else loop
        for loop in state.loops
    ]
    optimise(state, state.options.optimisation.final)
