"""Step 6: a map without the loops that contradict the rest of the graph, all together.

In a hall of like aisles, a laser that sees a few metres, or a narrow sector, finds the next aisle in place of
the right one, and again and again along it. Such loops agree with each other, so none of them stands out, but
the way between them is bent, and its relations say so. Where odometry leads all along, the map is made again
from the track alone: its joint matches close the loops that fit it.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.graph.optimise.graduated_nonconvexity import chi2_by_three
from nscan_cli.poses import are_known, compose
from nscan_cli.slam.backend.contradicting_visits import worst_violation
from nscan_cli.slam.backend.degenerate_relations import all_widened_relations
from nscan_cli.slam.backend.refinement import refine
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.state import SlamState


def mend_contradicting_loops(state: SlamState) -> None:
    """Map again from the track alone where loops contradict the rest of the graph.

    What comes of it is kept if its relations agree, and its visits contradict each other no more than before.
    Changes what `refine` changes, and judged.
    """
    odometry, most = state.odometry, state.options.loop_closure.max_mean_chi2
    is_led = odometry is not None and bool(are_known(odometry).all()) and not state.breaks
    if not (is_led and state.options.nscan.loops) or _mean_chi2(state) <= most:
        return
    before, restore = worst_violation(state), state.snapshot()
    state.matched_pairs, state.nscan_relations, state.loops, state.places = [], [], [], []
    state.energies.forget()
    state.route = _track_alone(state.route)
    refine(state, search=False)
    after = worst_violation(state)
    is_worse = before is not None and after is not None and after.share > before.share
    if is_worse or _mean_chi2(state) > most:
        restore()


def _mean_chi2(state: SlamState) -> float:
    """The mean χ² of all relations, each with three degrees of freedom."""
    relations = all_widened_relations(state)
    if not relations:
        return 0.0
    return float(chi2_by_three(state.energies.of(state.route, relations), state.poses).mean())


def _track_alone(route: Route) -> Route:
    """The route with the poses of tracking."""
    poses = [route.poses[0]]
    for relation in route.chain[: len(route.poses) - 1]:
        poses.append(compose(poses[-1], relation.measurement))
    return route._replace(poses=np.array(poses))
