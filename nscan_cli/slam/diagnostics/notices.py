"""What a user should know of the way that a log was mapped: what broke, and what was not believed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nscan_cli.files.counting import counted
from nscan_cli.graph.optimise.robust import chi2_by_three
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import relative
from nscan_cli.slam.diagnostics.free_space_violations import free_space_violations
from nscan_cli.slam.diagnostics.odometry_disagreement import odometry_disagreements
from nscan_cli.slam.diagnostics.view_mismatch import view_mismatches
from nscan_cli.slam.frontend.odometry_checks import jumps_of, repeating
from nscan_cli.slam.state import SlamState

MOST_NAMED = 10
"""Scans or stretches that a notice names."""

PAUSE = 3.0
"""Scans are missing when the next one comes after so many times the usual period."""

EXPECTED = 3.0
"""Mean of χ² for three degrees of freedom. That of all relations is below 1 on sound logs; a loop joins what
has drifted, and twice as much is no sign of a mistake."""


def notices(state: SlamState) -> list[str]:
    """What went wrong on the way, as whole sentences."""
    log, found = state.log, []
    if state.breaks:
        found.append(f"tracking broke at {_scans(log, state.breaks)}; of the way there nothing is known")
    jumps = state.odometry_jumps.tolist()
    if jumps:
        found.append(f"the odometry jumps at {_scans(log, jumps)}; these steps are not believed")
    if len(state.frozen_scans):
        found.append(
            f"the laser repeats itself at {_scans(log, state.frozen_scans.tolist())}; these are not matched"
        )
    found += _without_odometry(state) if state.odometry is None else _of_odometry(state)
    return found + _unlike(state) + _contradictions(state) + _looked_through(state)


def _of_odometry(state: SlamState) -> list[str]:
    """Gaps that odometry alone leads over, and where it contradicts the scans."""
    log, odometry, route = state.log, state.odometry, state.route
    assert odometry is not None
    found, far, turned = [], state.options.breaks.bridged_distance, state.options.breaks.bridged_turn
    steps, periods = relative(odometry[1:], odometry[:-1]), np.diff(log.times)
    came_far = (np.hypot(steps[:, 0], steps[:, 1]) > far) | (np.abs(steps[:, 2]) > turned)
    usual = float(np.median(periods)) if len(periods) else 0.0
    gaps = (np.flatnonzero(came_far & (periods > PAUSE * usual)) + 1).tolist()
    if gaps:
        found.append(
            f"there are no scans on the way to {_scans(log, gaps)}, "
            f"by odometry more than {far:g} m or {turned:g} rad"
        )
    apart = odometry_disagreements(route.rows, route.poses, odometry, state.breaks)
    if apart:
        some = "; ".join(
            f"{each.by_odometry:.1f} m and {each.by_scans:.1f} m from scan {log.numbers[each.first]} "
            f"to {log.numbers[each.last]}"
            for each in apart[:MOST_NAMED]
        )
        more = "" if len(apart) <= MOST_NAMED else f"; and {counted(len(apart) - MOST_NAMED, 'more stretch')}"
        found.append(
            f"odometry and scans disagree about the way: {some}{more}; "
            "odometry is wrong there, or tracking has slipped"
        )
    return found


def _without_odometry(state: SlamState) -> list[str]:
    """Where the robot may have gone on unseen, and where it came farther than it can."""
    log, found = state.log, []
    same = repeating(log, np.ones(max(len(log) - 1, 0), dtype=np.bool_)).tolist()
    if same:
        found.append(
            f"the laser repeats itself at {_scans(log, same)}: it hangs, or the robot stands; "
            "without odometry it counts as standing"
        )
    jumps = np.setdiff1d(jumps_of(np.concatenate(state.tracked)), state.breaks).tolist()
    if jumps:
        found.append(
            f"the scans jump at {_scans(log, jumps)}, farther than the robot drives from one to the next: "
            "scans are missing, it was carried, or tracking has slipped; how far it came is not known"
        )
    return found


def _unlike(state: SlamState) -> list[str]:
    """Where tracking may have held on to what goes along."""
    tracking, breaks = state.options.tracking, state.options.breaks
    poses = np.concatenate(state.tracked)
    worst = view_mismatches(state.log, poses, state.keyframes.list, tracking.max_range, breaks, state.threads)
    if worst is None:
        return []
    first, last = state.log.numbers[[worst.first, worst.last]].tolist()
    return [
        f"scans {first} to {last} see other things than where they were found: the same in {worst.share:.0%} "
        "of all bearings; someone walks along, or tracking has slipped"
    ]


def _contradictions(state: SlamState) -> list[str]:
    """Whether the relations of the graph fit together as their information says they should."""
    relations = state.relations
    if not relations:
        return []
    chi2 = chi2_by_three(state.energies.of(state.route, relations), state.poses)
    loops = chi2[[relation.origin == "loop" for relation in relations]]
    mean, of_loops = float(chi2.mean()), float(loops.mean()) if len(loops) else 0.0
    if mean <= EXPECTED and of_loops <= 2 * EXPECTED:
        return []
    nodes = relations[int(np.argmax(chi2))].nodes
    return [
        f"relations contradict each other: their mean χ² is {mean:.1f}, that of loops {of_loops:.1f}, "
        f"for {EXPECTED:g} degrees of freedom; the map may be wrong, at {_scans(state.log, nodes)} above all"
    ]


def _looked_through(state: SlamState) -> list[str]:
    """Whether visits of a place contradict each other, however well they match."""
    worst = free_space_violations(state.log, state.route, state.options.nscan, state.threads)
    if worst is None or worst.share <= worst.most:
        return []
    first, last = state.log.numbers[[worst.first, worst.last]].tolist()
    return [
        f"places do not look as they did before: from scan {first} to {last}, {worst.share:.1%} of what one "
        f"visit saw is looked through from another, at most {worst.most:.1%} in a sound map; the map is "
        "wrong there, or much has moved"
    ]


def _scans(log: LaserLog, rows: Sequence[int]) -> str:
    """The numbers of the scans in some rows, of many the first."""
    some = ", ".join(str(log.numbers[row]) for row in rows[:MOST_NAMED])
    more = "" if len(rows) <= MOST_NAMED else f" and {len(rows) - MOST_NAMED} more"
    return f"scan{'s' if len(rows) > 1 else ''} {some}{more}"
