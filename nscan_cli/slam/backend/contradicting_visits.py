"""Step 6: a search for loops where visits of a place contradict each other in the finished map.

Tracking that slips in a turn by a few degrees is surer of itself than it should be. Then a loop many metres
farther on is not searched far enough, and the map is wrong without any contradiction between relations. The
beams of one visit tell: they pass through what another visit saw.
"""

from __future__ import annotations

from nscan_cli.slam.backend.refinement import refine
from nscan_cli.slam.loop_closure.close_loops import close_loops_between
from nscan_cli.slam.loop_closure.free_space_violations import (
    FreeSpaceViolation,
    free_space_violations,
    is_sound,
)
from nscan_cli.slam.state import SlamState


def mend_contradicting_visits(state: SlamState) -> None:
    """Search for loops again, and farther, in the stretch that contradicts earlier visits most.

    What is found is kept if the contradiction goes by it. Changes what `refine` changes, and judged.
    """
    options, before = state.options.loop_closure, worst_violation(state)
    if not state.options.nscan.loops or before is None or is_sound(before, options.free_space):
        return
    restore = state.snapshot()
    if not close_loops_between(state, before.first, before.last):
        return
    refine(state)
    after = worst_violation(state)
    if after is None or is_sound(after, options.free_space):
        return
    if after.share > options.contradicted_share * before.share:
        restore()


def worst_violation(state: SlamState) -> FreeSpaceViolation | None:
    """The worst stretch of the present route, see `free_space_violations`; found once for each route."""
    judged = state.judged
    if judged is None or judged[0] is not state.route:
        options = state.options
        worst = free_space_violations(
            state.log, state.route, options.nscan, options.loop_closure.free_space, state.threads
        )
        judged = state.judged = state.route, worst
    return judged[1]
