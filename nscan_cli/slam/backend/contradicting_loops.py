"""Step 6: a map without the loops that contradict the rest of the graph, all together.

In a hall of like aisles, a laser that sees a few metres, or a narrow sector, finds the next aisle in place of
the right one, and again and again along it. Such loops agree with each other, so none of them stands out. But
the way between them is bent, and its relations say so; or beams of one visit pass through what another one
saw. Then the map is made again from the track alone: its joint matches close the loops that fit it.
"""

from __future__ import annotations

from nscan_cli.graph.optimise.graduated_nonconvexity import chi2_by_three
from nscan_cli.poses import are_known
from nscan_cli.slam.backend.contradicting_visits import worst_violation
from nscan_cli.slam.backend.degenerate_relations import all_widened_relations
from nscan_cli.slam.backend.refinement import refine
from nscan_cli.slam.keyframes.route import Route, extended
from nscan_cli.slam.loop_closure.free_space_violations import is_sound
from nscan_cli.slam.state import SlamState


def mend_contradicting_loops(state: SlamState) -> None:
    """Map again from the track alone where loops contradict the rest of the graph, or visits each other.

    What comes of it is kept if neither is so any longer; or, where odometry leads all along, if relations
    agree and visits contradict each other no more than before. Without odometry visits may only have drifted
    apart: then some of them must still be compared, and enough loops closed. Changes what `refine` changes,
    and judged.
    """
    options, odometry, closed = state.options.loop_closure, state.odometry, _closed(state)
    if state.breaks or not closed:
        return
    is_led = odometry is not None and bool(are_known(odometry).all())
    before, is_bent = worst_violation(state), is_led and _mean_chi2(state) > options.max_mean_chi2
    is_unsound = before is not None and not is_sound(before, options.free_space)
    if not (is_bent or is_unsound):
        return
    restore = state.snapshot()
    state.matched_pairs, state.nscan_relations, state.loops, state.places = [], [], [], []
    state.energies.forget()
    state.route = _track_alone(state.route)
    refine(state, search=False)
    after = worst_violation(state)
    if after is None:
        is_better = is_led
    elif is_sound(after, options.free_space):
        is_better = is_led or _closed(state) >= options.least_closed_share * closed
    else:
        is_better = is_bent and before is not None and after.share <= before.share
    if not is_better or _mean_chi2(state) > options.max_mean_chi2:
        restore()


def _closed(state: SlamState) -> int:
    """The number of keyframes that loops relate."""
    return len({node for relation in state.loop_relations() for node in relation.nodes})


def _mean_chi2(state: SlamState) -> float:
    """The mean χ² of all relations, each with three degrees of freedom."""
    energy = state.energies.of(state.route, all_widened_relations(state))
    return float(chi2_by_three(energy, state.poses).mean())


def _track_alone(route: Route) -> Route:
    """The route with the poses of tracking."""
    begin = route._replace(rows=route.rows[:1], paths=route.paths[:1], poses=route.poses[:1])
    return extended(begin, len(route.poses))
