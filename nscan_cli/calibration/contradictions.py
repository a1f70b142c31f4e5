"""What the file says of odometry, mounting and clocks, compared with the steps that its scans measure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.calibration import clock_findings, findings, mount_findings
from nscan_cli.calibration.changed_odometry import (
    with_mirrored_odometry,
    with_scaled_odometry,
    with_seen_mount,
)
from nscan_cli.calibration.clock_offset import ClockOffset, clock_offset
from nscan_cli.calibration.findings import Finding
from nscan_cli.calibration.gathered_evidence import gathered_evidence
from nscan_cli.calibration.measured_steps import KnownSteps, MeasuredSteps, measure_steps
from nscan_cli.calibration.mount_fit import TurnFit
from nscan_cli.calibration.moved_stamps import with_delay
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.position_findings import of_opposite_turns, of_positions
from nscan_cli.calibration.robust_fit import TO_SIGMA
from nscan_cli.calibration.scale_change import SIGMA_OF_MEDIAN
from nscan_cli.calibration.step_evidence import (
    StepEvidence,
    are_of_one_size,
    explains_positions,
    is_change,
    is_excluded,
    is_wrong_scale,
    never_changes,
    turns_agree,
)
from nscan_cli.calibration.step_sampling import telling_steps
from nscan_cli.calibration.unsteady_stamps import unsteady_delay
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import wrap

ONE_AXIS_REVERSED = np.array([-1.0, 1.0, 1.0])
"""Factors of poses: with x and y it is the same, seen from behind; so it is with the sign of headings."""


def find_contradictions(
    log: LaserLog, reading: ReadingOptions, options: FileCheckOptions, known: KnownSteps | None = None
) -> list[Finding]:
    """What the scans of a log contradict; empty without odometry, and where the scans tell too little.

    `known` are the steps that its scans have measured already; others are added.
    """
    known = {} if known is None else known
    if log.odometry is None:
        return []
    # A factor that is offered takes the place of the one that the readings were multiplied by.
    reading = replace(reading, range_scale=log.range_scale)
    evidence = _evidence(log, options, known)
    if evidence is None:
        return []
    unchanged, driven = evidence.unchanged
    if unchanged >= max(options.min_steps, options.min_unchanged_share * driven):
        return [findings.unchanging_scans(unchanged, driven)]
    if evidence.moving < options.min_steps:
        return []
    is_still = never_changes(log.odometry, options.still)
    if is_still[:2].all():
        return [findings.frozen_odometry(evidence, "odometry" if is_still[2] else "the position by odometry")]
    view = _of_view(log, evidence, reading, options)
    if view is not None:
        return [view]
    turns = evidence.turns
    by_turns = turns is not None and (
        evidence.disagreement > options.clock.max_disagreement or not turns_agree(turns, options)
    )
    # Where the robot turns steadily, turns agree at another time as well, and positions do not.
    is_explained = any(explains_positions(fit, options) for fit in (evidence.fit, evidence.mirrored_fit))
    if turns is not None and (by_turns or not is_explained):
        found = _of_clocks(log, evidence.steps, reading, options, known, by_turns)
        if found:
            return found
    unsteady = unsteady_delay(log, evidence, options, known)
    if unsteady is not None:
        return [findings.unsteady_stamps(*unsteady, reading, options.lag)]
    changed = _of_change(log, evidence, reading, options)
    if changed is not None:
        return [changed]
    fit = evidence.fit
    unusable = _unusable(evidence, turns, reading, options)
    if unusable is not None:
        return [unusable]
    if turns is not None and _are_opposite(turns, evidence, options):
        mirrored = evidence.mirrored_fit
        if are_of_one_size(turns, options) and mirrored is not None and explains_positions(mirrored, options):
            return of_opposite_turns(log.mount, turns, mirrored, evidence, reading, options)
        return [findings.wrong_turns(turns), *of_positions(log.mount, fit, evidence, reading, options)]
    found = []
    if turns is not None and not turns_agree(turns, options):
        never_turns = bool(is_still[2]) and turns.steps >= options.min_turns_unmeasured
        if never_turns or _are_told(turns, options) or _is_of_other_size(turns, options):
            found.append(findings.wrong_turns(turns))
    # Wrong turns would have the laser anywhere on the robot.
    tell_place = turns is None or turns_agree(turns, options)
    return found + of_positions(log.mount, fit, evidence, reading, options, tell_place)


def changed_view(
    log: LaserLog, reading: ReadingOptions, options: FileCheckOptions, known: KnownSteps
) -> Finding | None:
    """A change of the view within a log, the only one of its contradictions that is looked for; None if there
    is none. `known` is that of `find_contradictions`."""
    evidence = _evidence(log, options, known)
    if evidence is None or evidence.moving < options.min_steps:
        return None
    return _of_view(log, evidence, reading, options)


def by_most_steps(log: LaserLog, options: FileCheckOptions, known: KnownSteps) -> LaserLog | None:
    """The log with its odometry as most steps have it, though they may not explain the others; None if that
    is as the file has it, or they tell too little. `known` is that of `find_contradictions`."""
    evidence = _evidence(log, options, known)
    if evidence is None or evidence.moving < options.min_steps:
        return None
    is_image = evidence.turns is not None and evidence.turns.ratio < 0.0
    fit = evidence.mirrored_fit if is_image else evidence.fit
    if fit is None:
        return None
    is_turned = abs(float(wrap(fit.mount[2] - log.mount[2]))) > options.min_mount_turn
    if not (is_image or is_turned or is_wrong_scale(fit, options)):
        return None
    # Few steps tell where the laser is.
    mount, log = np.append(log.mount[:2], fit.mount[2]), with_scaled_odometry(log, fit.scale)
    return with_mirrored_odometry(log, mount) if is_image else with_seen_mount(log, mount)


def is_explained(log: LaserLog, options: FileCheckOptions, known: KnownSteps) -> bool:
    """Whether a mounting and a scale explain the steps, of scans as they are or mirrored. `known` is that of
    `find_contradictions`."""
    evidence = _evidence(log, options, known)
    fits = [] if evidence is None else [evidence.fit, evidence.mirrored_fit]
    return evidence is None or any(explains_positions(fit, options) for fit in fits)


def _evidence(log: LaserLog, options: FileCheckOptions, known: KnownSteps) -> StepEvidence | None:
    """The steps of a log and its odometry at the middle beams: that is where scans tell the robot is."""
    odometry = log.at_middle_of_sweeps().odometry
    return None if odometry is None else gathered_evidence(log, odometry, options, known)


def _are_told(turns: TurnFit, options: FileCheckOptions) -> bool:
    return turns.steps >= options.min_steps and turns.spread <= options.max_spread


def _is_of_other_size(turns: TurnFit, options: FileCheckOptions) -> bool:
    """Whether turns are too large or too small in the mean, however much they vary: outdoors scans tell
    single ones badly, and some robots slip."""
    sigma = SIGMA_OF_MEDIAN * TO_SIGMA * turns.spread / turns.steps**0.5
    off = abs(abs(turns.ratio) - 1.0) - options.max_turn_error
    return turns.steps >= options.min_steps and off > options.turn_sigmas * sigma


def _are_opposite(turns: TurnFit, evidence: StepEvidence, options: FileCheckOptions) -> bool:
    """Whether odometry turns the other way than the scans: in most steps, or by a clear multiple."""
    share = evidence.opposite_share
    is_most = share >= options.min_opposite_share
    is_most &= (2.0 * share - 1.0) * turns.steps >= options.min_opposite_excess
    return turns.ratio < 0.0 and (_are_told(turns, options) or is_most)


def _unusable(
    evidence: StepEvidence, turns: TurnFit | None, reading: ReadingOptions, options: FileCheckOptions
) -> Finding | None:
    """Why odometry cannot be used at all; None if it can."""
    fits = (evidence.fit, evidence.mirrored_fit)
    least = min(
        (fit.tail for fit in fits if fit is not None and explains_positions(fit, options)), default=np.inf
    )
    other = evidence.fit_with_signs(ONE_AXIS_REVERSED)
    # Where the robot mostly drives along one axis, a laser that looks elsewhere explains most steps as well.
    is_better = other is not None and other.tail < options.max_sign_tail * least
    if is_better and explains_positions(other, options):
        is_heading = turns is not None and turns.ratio < 0.0
        return findings.wrong_signs(evidence, "headings" if is_heading else "x or y", reading)
    excluded = is_excluded(evidence.fit, options) and is_excluded(evidence.mirrored_fit, options)
    if excluded and not evidence.is_explained_without_place:
        return findings.unexplained_positions(evidence)
    if turns is not None and turns.steps >= options.min_steps and turns.spread > options.excluded_turn_spread:
        return findings.unexplained_turns(turns)
    return None


def _of_change(
    log: LaserLog, evidence: StepEvidence, reading: ReadingOptions, options: FileCheckOptions
) -> Finding | None:
    """A change of the scale of odometry or ranges within the log; None if there is none that explains it."""
    change = evidence.change
    if change is None or not is_change(change, options, options.change.sigmas):
        return None
    without = evidence.fit_without(change)
    if not explains_positions(without, options):
        return None
    place = _place(log, evidence, change.step, reading)
    return findings.changed_scale(change, evidence.moving, place, reading)


def _of_view(
    log: LaserLog, evidence: StepEvidence, reading: ReadingOptions, options: FileCheckOptions
) -> Finding | None:
    """Readings in another order, or a laser that looks elsewhere, from a scan on; None if nothing changes."""
    view = options.view
    turned = evidence.direction_change(log.mount, view.min_steps)
    # Reversed readings of a laser that looks aside lead the other way, and a few turns tell them.
    is_image = turned is not None and turned.may_be_mirrored(view.min_direction)
    mirrored = evidence.turn_change(view.doubt_steps if is_image else view.min_steps)
    if mirrored is not None and mirrored.is_order:
        return findings.changed_order(mirrored, _place(log, evidence, mirrored.step, reading), reading)
    if turned is None or not turned.exceeds(view.min_direction, view.sigmas):
        return None
    # With a wrong sign of x or y directions depend on where the robot heads.
    if explains_positions(evidence.fit_with_signs(ONE_AXIS_REVERSED), options):
        return None
    if not explains_positions(evidence.fit_turned(turned), options):
        return None
    steps = [turned.step] if turned.end is None else [turned.step, turned.end]
    places = [_place(log, evidence, step, reading) for step in steps]
    return mount_findings.changed_direction(turned, places, log.mount, options)


def _place(
    log: LaserLog, evidence: StepEvidence, step: int, reading: ReadingOptions
) -> findings.PlaceOfChange:
    """The scans between which a step begins something else."""
    # Where the step before that one begins, and where that one ends.
    before, behind = int(evidence.both.first[step - 1]), int(evidence.both.last[step])
    end, start = (log.times[[before, behind]] - log.times[0] + (reading.start or 0.0)).tolist()
    return findings.PlaceOfChange(int(log.numbers[before]), int(log.numbers[behind]), end, start)


def _of_clocks(
    log: LaserLog,
    steps: MeasuredSteps,
    reading: ReadingOptions,
    options: FileCheckOptions,
    known: KnownSteps,
    by_turns: bool,
) -> list[Finding]:
    """Findings of the odometry's clock: the offset that explains why turns disagree, if there is one.

    Few steps can agree at some offset by chance. So if an offset is likely, more steps are measured. Turns of
    mirrored scans are compared, too. Unless turns disagree by much (`by_turns`), it must explain positions:
    they disagree for other reasons as well.
    """
    tries = [(sign, clock_offset(log, steps, options.clock, sign)) for sign in (1.0, -1.0)]
    signs = [sign for sign, found in tries if found and _is_offset(found, options.clock.first_gain, options)]
    if not signs:
        return []
    rows = telling_steps(log, options.steps, options.more_steps)
    steps = measure_steps(log, rows, options.steps, known=known, turns_alone=True)
    offsets = [(sign, clock_offset(log, steps, options.clock, sign)) for sign in signs]
    told = [
        (found.disagreement, sign, found)
        for sign, found in offsets
        if found
        and _is_offset(found, options.clock.gain, options)
        and (by_turns or _explains_all(log, steps, found.offset, options))
    ]
    if not told:
        return []
    _, sign, best = min(told)
    clocks = clock_findings.two_clocks(best, reading)
    if sign > 0.0:
        return [clocks]
    evidence = "turns by odometry, at that offset, are those by scans the other way round"
    return [clocks, findings.opposite_turns(evidence, reading, False, False)]


def _explains_all(log: LaserLog, steps: MeasuredSteps, offset: float, options: FileCheckOptions) -> bool:
    """Whether a mounting and a scale explain the positions if `offset` (s) is added to odometry's stamps."""
    moved = with_delay(log, offset).at_middle_of_sweeps().odometry
    there = None if moved is None else StepEvidence(log, moved, steps, options)
    fits = [] if there is None else [there.fit, there.mirrored_fit]
    return any(explains_positions(fit, options) for fit in fits)


def _is_offset(found: ClockOffset, gain: float, options: FileCheckOptions) -> bool:
    is_better = found.disagreement < gain * min(found.as_stamped, found.elsewhere)
    is_better &= found.disagreement <= options.clock.max_left
    return is_better and abs(found.offset) >= options.clock.min_offset
