"""Optimisation of the keyframes' global poses from all relations (paper, IV and V: step 5 of the loop)."""

from __future__ import annotations

from nscan_cli.graph.optimise import graph_solver
from nscan_cli.graph.optimise.graph_solver import StopOptions
from nscan_cli.slam.backend.degenerate_relations import all_widened_relations
from nscan_cli.slam.backend.subgraph import Subgraph
from nscan_cli.slam.state import SlamState


def optimise(state: SlamState, stop: StopOptions, part: Subgraph | None = None) -> None:
    """Optimise the poses of all keyframes, or of a part. Changes route, schedule."""
    part = Subgraph(all_widened_relations(state)) if part is None else part
    state.schedule.optimised(len(state.poses), part)
    if len(state.poses) < 2:
        return
    energy = state.energies.of(state.route, part.relations, 0, part.free)
    optimum = graph_solver.optimise_poses(energy, state.poses, stop)
    state.route = state.route._replace(poses=optimum.poses)


def optimise_if_due(state: SlamState) -> None:
    """Optimise what the schedule says once the graph has changed enough. Changes route, schedule."""
    if state.schedule.is_due(len(state.poses)):
        part = state.schedule.due(state.route, state.relations)
        optimise(state, state.options.optimisation.growing, part)
