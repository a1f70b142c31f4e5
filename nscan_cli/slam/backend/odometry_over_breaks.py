"""Step 5: what odometry says over a break of the track, as a relation that the loops can switch off.

If someone carried the robot, odometry is wrong there, and if the break is none, it is right. The scans beside
the break do not tell, but loops over it do: graduated non-convexity finds whether they contradict odometry
(Yang et al. 2020). Without such loops the way over the break stays unknown.
"""

from __future__ import annotations

from bisect import bisect_left

import numpy as np

from nscan_cli.graph.optimise.graduated_nonconvexity import contradicting
from nscan_cli.graph.relations.pairwise import Pairwise
from nscan_cli.matching.motion_model import odometry_prior
from nscan_cli.poses import are_known
from nscan_cli.slam.backend.degenerate_relations import all_widened_relations
from nscan_cli.slam.backend.optimisation import optimise
from nscan_cli.slam.state import SlamState


def believe_odometry_over_breaks(state: SlamState) -> None:
    """Add odometry's relations over the breaks that loops join, but those that these contradict.

    Changes odometry_relations, route, schedule.
    """
    state.odometry_relations = [
        relation
        for row in state.breaks
        if _is_joined_by_loops(state, row) and (relation := _odometry_over(state, row)) is not None
    ]
    if not state.odometry_relations:
        return
    added = {id(relation) for relation in state.odometry_relations}
    # These are in the same order.
    energy = state.energies.of(state.route, all_widened_relations(state))
    doubted = np.array([id(relation) in added for relation in state.relations], dtype=np.bool_)
    wrong = contradicting(energy, state.poses, doubted, state.options.rejection)[doubted]
    state.odometry_relations = [
        relation for relation, is_wrong in zip(state.odometry_relations, wrong, strict=True) if not is_wrong
    ]
    if state.odometry_relations:
        optimise(state, state.options.optimisation.final)


def _odometry_over(state: SlamState, row: int) -> Pairwise | None:
    """The step by odometry to the keyframe of a row from the one before; None where odometry is missing."""
    rows = state.route.rows
    position = int(np.searchsorted(rows, row))
    if state.odometry is None or not 0 < position < len(rows):
        return None
    nodes = int(rows[position - 1]), int(rows[position])
    before, after = state.odometry[list(nodes)]
    step = odometry_prior(before, after, state.options.tracking.scan.odometry)
    return Pairwise(nodes, step.mean, step.information, "odometry") if are_known(step.mean) else None


def _is_joined_by_loops(state: SlamState, row: int) -> bool:
    """Whether a loop joins the segments that end and begin at a row before which the track broke."""
    place = bisect_left(state.breaks, row)
    begin = state.breaks[place - 1] if place else 0
    end = state.breaks[place + 1] if place + 1 < len(state.breaks) else len(state.log)
    return any(
        any(begin <= node < row for node in loop.nodes) and any(row <= node < end for node in loop.nodes)
        for loop in state.loop_relations()
    )
