"""Notices: what a user should know about how a log was mapped, in whole sentences."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from nscan_cli.calibration.companions import find_companion
from nscan_cli.files.text import counted, shortened_list
from nscan_cli.graph.optimise.graduated_nonconvexity import chi2_by_three
from nscan_cli.logs.beam_mask import mask_text
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import relative
from nscan_cli.slam.backend.contradicting_visits import worst_violation
from nscan_cli.slam.backend.degenerate_relations import all_widened_relations, degenerate_stretches
from nscan_cli.slam.diagnostics.odometry_disagreement import carried_scans, odometry_disagreements
from nscan_cli.slam.diagnostics.view_mismatch import view_mismatches
from nscan_cli.slam.frontend.odometry_checks import jumps_of, repeated_scans
from nscan_cli.slam.loop_closure.free_space_violations import is_sound, sound_share
from nscan_cli.slam.state import SlamState

MOST_NAMED = 10
"""Scans or stretches that a notice names."""


def notices(state: SlamState, companions_checked: bool = False) -> list[str]:
    """What went wrong, one sentence each.

    `companions_checked`: whether what goes along with the robot was looked for before the log was mapped.
    """
    log, found = state.log, []
    confirmed = [relation.nodes[1] for relation in state.odometry_relations]
    unknown = [row for row in state.breaks if row not in confirmed]
    if unknown:
        found.append(f"tracking broke at {_numbered(log, unknown)}; how the robot moved there is unknown")
    if confirmed:
        found.append(
            f"tracking broke at {_numbered(log, confirmed)}; odometry and loops agree how it moved there"
        )
    jumps = state.odometry_jumps.tolist()
    found += _drives(state, jumps)
    if jumps:
        found.append(f"the odometry jumps at {_numbered(log, jumps)}; each is replaced by the step before it")
    stalls = state.odometry_stalls.tolist()
    if stalls:
        found.append(
            f"the odometry stands still and catches up at {_numbered(log, stalls)}; "
            "the step there is shared out over the scans before it"
        )
    frozen = state.frozen_scans.tolist()
    if frozen:
        found.append(f"the laser repeats itself at {_numbered(log, frozen)}; these scans are not matched")
    found += _scan_notices(state) if state.odometry is None else _odometry_notices(state)
    return (
        found
        + _degenerate_stretches(state)
        + ([] if companions_checked else _companions(state))
        + _view_mismatches(state)
        + _contradictions(state)
        + _free_space_violations(state)
    )


def _drives(state: SlamState, jumps: list[int]) -> list[str]:
    """Where odometry begins anew and the scans see another place, or after a pause: another drive."""
    log, periods = state.log, np.diff(state.log.times)
    longest = state.options.diagnostics.gap_periods * float(np.median(periods)) if len(periods) else 0.0
    rows = [row for row in jumps if row in state.breaks or periods[row - 1] > longest]
    if not rows:
        return []
    between = (log.reading.start or 0.0) + float(log.times[rows[0] - 1 : rows[0] + 1].mean() - log.times[0])
    return [
        f"odometry begins anew at {_numbered(log, rows)}, after a pause or where the scans see another "
        "place: there are likely several drives in the log, or the robot was carried; if they do not fit "
        f"together in the map, map each by itself: try --end {between:.2f}, or --start {between:.2f}"
    ]


def _odometry_notices(state: SlamState) -> list[str]:
    """Gaps that odometry alone bridges, and where odometry contradicts the scans."""
    log, odometry, route = state.log, state.odometry, state.route
    assert odometry is not None
    found, far, turned = [], state.options.breaks.bridged_distance, state.options.breaks.bridged_turn
    steps, periods = relative(odometry[1:], odometry[:-1]), np.diff(log.times)
    came_far = (np.hypot(steps[:, 0], steps[:, 1]) > far) | (np.abs(steps[:, 2]) > turned)
    usual = float(np.median(periods)) if len(periods) else 0.0
    gaps = (np.flatnonzero(came_far & (periods > state.options.diagnostics.gap_periods * usual)) + 1).tolist()
    if gaps:
        found.append(
            f"scans are missing before {_numbered(log, gaps)}: "
            f"by odometry the robot moved more than {far:g} m or {turned:g} rad there"
        )
    moved = carried_scans(np.concatenate(state.tracked), odometry, state.options.diagnostics.odometry)
    carried = np.setdiff1d(moved, [*state.breaks, *state.odometry_jumps]).tolist()
    if carried:
        found.append(
            f"odometry stands at {_numbered(log, carried)}, but the scans see another place: the robot was "
            "carried, or odometry is wrong there; how far it moved is taken from the scans"
        )
    apart = odometry_disagreements(
        route.rows, route.poses, odometry, state.breaks, state.options.diagnostics.odometry
    )
    if apart:
        named = _stretches(
            f"{each.by_odometry:.1f} m and {each.by_scans:.1f} m from scan {log.numbers[each.first]} "
            f"to {log.numbers[each.last]}"
            for each in apart
        )
        found.append(
            f"odometry and scans disagree about the distance driven: {named}; "
            "odometry is wrong there, or tracking slipped"
        )
    return found


def _scan_notices(state: SlamState) -> list[str]:
    """Without odometry: where the laser may have been frozen, and where the scans jump."""
    log, found = state.log, []
    same = repeated_scans(log, np.ones(max(len(log) - 1, 0), dtype=np.bool_)).tolist()
    if same:
        found.append(
            f"the laser repeats itself at {_numbered(log, same)}: it is frozen, or the robot stands still; "
            "without odometry the robot is assumed to stand still"
        )
    guessed = [each.row for each in state.route.keyframes if each.guess_variances.any()]
    if guessed:
        found.append(
            f"nothing that was seen before fits what the laser sees before {_numbered(log, guessed)}; "
            "without odometry the way there is a guess"
        )
    jumps_found = jumps_of(np.concatenate(state.tracked), state.options.odometry_checks)
    jumps = np.setdiff1d(jumps_found, state.breaks).tolist()
    if jumps:
        found.append(
            f"the scans jump at {_numbered(log, jumps)}, farther than the robot drives between two scans: "
            "scans are missing, the robot was carried, or tracking slipped; how far it moved is unknown"
        )
    return found


def _degenerate_stretches(state: SlamState) -> list[str]:
    """Without odometry: where steady motion alone says how far the robot went."""
    log, poses, sigmas = state.log, np.concatenate(state.tracked), state.weakest_sigmas
    if not sigmas:
        return []
    stretch, least = state.options.degenerate_relations.stretch, state.options.diagnostics.guessed_way
    options, told = replace(stretch, path=least), np.concatenate(sigmas)
    lost = int(np.isinf(told).sum())
    if lost > state.options.diagnostics.max_lost_share * len(told):
        return [
            f"no match for {counted(lost, 'scan')} of {len(told)}: nothing there was seen before, and "
            "without odometry nothing else tells how the robot moved; the laser sees too little, or the file "
            "is wrong"
        ]
    ways = degenerate_stretches(poses, log.times, told, options)
    if not ways:
        return []
    named = _stretches(
        f"{way.path:.1f} m from scan {log.numbers[way.first]} to {log.numbers[way.last]}"
        + ("" if way.is_long(options) else f" (at its usual speed {way.possible:.1f} m)")
        for way in ways
    )
    return [
        f"the walls do not show how far the robot went: {named}; "
        "without odometry steady motion is assumed there, and the length is a guess"
    ]


def _companions(state: SlamState) -> list[str]:
    poses, options = np.concatenate(state.tracked), state.options.file_check.companion
    found = find_companion(state.log, poses, options)
    if found is None:
        return []
    return [f"{found.seen}; try --mask {mask_text(found.mask(state.log.report.masked))}"]


def _view_mismatches(state: SlamState) -> list[str]:
    """The notice of scans for which tracking may have held on to something that moves along."""
    options, poses = state.options, np.concatenate(state.tracked)
    reach, view, judged = options.tracking.max_range, options.breaks.view, options.diagnostics.view
    worst = view_mismatches(state.log, poses, state.keyframes.list, reach, view, judged, state.threads)
    if worst is None:
        return []
    first, last = state.log.numbers[[worst.first, worst.last]].tolist()
    return [
        f"scans {first} to {last} do not see what the keyframes beside them see: they agree in only "
        f"{worst.share:.0%} of all directions; someone walks along, the robot tilts on a slope, or tracking "
        "slipped"
    ]


def _contradictions(state: SlamState) -> list[str]:
    """Whether the relations of the graph agree as well as their information says."""
    relations, options = all_widened_relations(state), state.options.diagnostics
    if not relations:
        return []
    chi2 = chi2_by_three(state.energies.of(state.route, relations), state.poses)
    loops = chi2[[relation.origin == "loop" for relation in relations]]
    mean, of_loops = float(chi2.mean()), float(loops.mean()) if len(loops) else 0.0
    if mean <= state.options.loop_closure.max_mean_chi2 and of_loops <= options.max_mean_loop_chi2:
        return []
    nodes = relations[int(np.argmax(chi2))].nodes
    return [
        f"relations contradict each other: their mean χ² is {mean:.1f}, that of loops {of_loops:.1f}, "
        f"for 3 degrees of freedom; the map may be wrong, most likely at {_numbered(state.log, nodes)}"
    ]


def _free_space_violations(state: SlamState) -> list[str]:
    worst, options = worst_violation(state), state.options.loop_closure.free_space
    if worst is None or is_sound(worst, options):
        return []
    most = sound_share(worst.within, options)
    first, last = state.log.numbers[[worst.first, worst.last]].tolist()
    return [
        f"places look different on another visit: from scan {first} to {last}, beams pass through "
        f"{worst.share:.1%} of what the first visit saw (at most {most:.1%} in a sound map); the map is "
        "wrong there, or much has moved"
    ]


def _stretches(named: Iterable[str]) -> str:
    return shortened_list(list(named), "more stretch", MOST_NAMED, "; ")


def _numbered(log: LaserLog, rows: Sequence[int]) -> str:
    numbers = [str(log.numbers[row]) for row in rows]
    return f"scan{'s' if len(rows) > 1 else ''} {shortened_list(numbers, most=MOST_NAMED)}"
