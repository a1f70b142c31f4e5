"""The check of the file: its odometry, mounting and clocks against the scans."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from nscan_cli.calibration.agreeing_odometry import agreeing
from nscan_cli.calibration.bearing_jitter import checked_bearings
from nscan_cli.calibration.changed_odometry import (
    with_mirrored_odometry,
    with_scaled_odometry,
)
from nscan_cli.calibration.clock_changes import checked_clock_change
from nscan_cli.calibration.companions import checked_companion
from nscan_cli.calibration.compared_ranges import compare_ranges
from nscan_cli.calibration.contradictions import (
    by_most_steps,
    changed_view,
    find_contradictions,
    is_explained,
)
from nscan_cli.calibration.findings import Finding
from nscan_cli.calibration.heading_jumps import checked_heading_jumps
from nscan_cli.calibration.held_odometry import checked_held
from nscan_cli.calibration.measured_steps import KnownSteps
from nscan_cli.calibration.moved_stamps import with_delay
from nscan_cli.calibration.odometry_delay import checked_delay, said_late
from nscan_cli.calibration.odometry_units import checked_units
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.order_jumps import checked_order
from nscan_cli.calibration.range_jumps import checked_ranges
from nscan_cli.calibration.reversed_headings import checked_headings
from nscan_cli.calibration.scaled_stretches import checked_stretches
from nscan_cli.calibration.sweep_check import checked_sweep
from nscan_cli.calibration.unsigned_odometry import checked_signs
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import are_known


@dataclass(frozen=True)
class CheckedFile:
    """A log with what was put right."""

    log: LaserLog
    reading: ReadingOptions
    """The options that read the log as it is now."""
    messages: list[str]
    companions_checked: bool = False
    """Whether what goes along with the robot was looked for at all scans, by their odometry, or cannot be:
    with a wrong mounting walls seem to be where the robot has been."""
    has_findings: bool = False
    """Whether scans contradict the file, by the steps that were measured."""


def checked_file(log: LaserLog, reading: ReadingOptions, options: FileCheckOptions) -> CheckedFile:
    """Check a log that was read with these options, and put right what is beyond doubt."""
    log, reading, said = checked_sweep(log, reading, options)
    if reading.as_recorded:
        return CheckedFile(log, reading, said)
    log, jitter = checked_bearings(log, options)
    compared = compare_ranges(log, options)
    log, order = checked_order(log, compared, options)
    if order:
        compared = compare_ranges(log, options)
    log, jumps = checked_ranges(log, compared, options)
    known: KnownSteps = {}
    log, headings = checked_headings(log, reading, options, known)
    log, turned_back = checked_heading_jumps(log, options, known)
    recorded, is_given = log, bool(reading.clock_offset)
    offset, in_metres = 0.0, list[str]()
    while True:
        units, held, motion, along = _compared_file(recorded, reading, options, known)
        found, is_last = motion.findings, is_given or bool(offset)
        later = 0.0 if is_last else round(sum(finding.clock_offset for finding in found), 2)
        scales = [finding for finding in found if "odometry_scale" in finding.corrected and not in_metres]
        # Whatever else is wrong shows once both are compared at the same times, and in one unit.
        if later:
            offset, recorded = later, with_delay(recorded, later)
        elif scales:
            corrected = replace(reading, **scales[0].corrected)
            recorded, reading = _as_read(recorded, reading, corrected), corrected
            in_metres = [scales[0].message]
        else:
            break
    log, reading, signed, known = motion.log, motion.reading, motion.signed, motion.known
    findings, stretched = motion.findings, motion.stretched
    reversing, late = motion.reversing, motion.set_anew
    if delay := round(offset + motion.delay, 2):
        reading = replace(reading, clock_offset=round(reading.clock_offset + delay, 2))
        late = [*late, said_late(delay, reading.clock_offset, "because scans are matched by odometry")]
    if reversing:
        # A laser that is turned within the log sees the robot go elsewhere, too. The steps by scans stay.
        turned = changed_view(log, reading, options, known)
        findings, signed, reversing = (findings, signed, reversing) if turned is None else ([turned], log, [])
    is_mirror_image = any(finding.is_mirror_image for finding in findings)
    if is_mirror_image:
        # The ranges changed as its mirror image says.
        signed, reversing = checked_signs(_mirrored(log, findings), options.unsigned, options.steps)
    log = signed
    if held and any(finding.is_of_clocks for finding in findings):
        # A clock that is behind makes odometry begin late, as if it stood.
        log, units, held, reversing = recorded, [], [], []
    for finding in findings:
        if finding.corrected:
            corrected = replace(reading, **finding.corrected)
            log, reading = _as_read(log, reading, corrected), corrected
    if not is_mirror_image:
        # In the unit of the mounting.
        log = agreeing(log, findings)
    said += jitter + order + jumps + headings + turned_back + units + held + stretched + reversing + late
    said += in_metres + [finding.message for finding in findings] + along
    if any(not finding.corrected for finding in findings):
        # Where the robot has been is in doubt.
        is_elsewhere = any(finding.is_of_mount or finding.is_of_view for finding in findings)
        return CheckedFile(log, reading, said, is_elsewhere, True)
    is_checked = log.odometry is not None and bool(are_known(log.odometry).all())
    if not along:
        log, reading, along = checked_companion(log, reading, options.companion)
        said += along
    return CheckedFile(log, reading, said, is_checked, bool(findings))


@dataclass(frozen=True)
class _Compared:
    """A log whose odometry is compared with its scans."""

    log: LaserLog
    """With the scale and the delay of its odometry put right."""
    reading: ReadingOptions
    signed: LaserLog
    """With its signs put right, too."""
    known: KnownSteps
    """The steps that its scans have measured."""
    findings: list[Finding]
    stretched: list[str]
    """Messages on parts in another scale, on the signs, and on a clock that was set."""
    reversing: list[str]
    set_anew: list[str]
    delay: float
    """s that were added to the stamps of its odometry."""

    @property
    def measured(self) -> int:
        """The number of steps that the scans have measured."""
        return sum(step is not None for step in self.known.values())

    @property
    def is_changed(self) -> bool:
        """Whether something was put right, or is to be said."""
        return bool(self.findings or self.stretched or self.reversing or self.set_anew or self.delay)


def _compared_file(
    recorded: LaserLog, reading: ReadingOptions, options: FileCheckOptions, known: KnownSteps
) -> tuple[list[str], list[str], _Compared, list[str]]:
    """Compare a log as it was recorded: messages on units, on odometry that stands, and on someone who goes
    along, around what is compared then."""
    log, units = checked_units(recorded, options.units, options.steps)
    as_recorded = log
    log, held = checked_held(log, options.held, options.steps)
    if held:
        # A clock that is behind makes odometry begin late, as if it stood.
        motion = _compared(as_recorded, reading, options, known)
        if any(finding.clock_offset for finding in motion.findings):
            return units, [], motion, []
    motion = _compared(log, reading, options, known)
    # What the scans show may be someone who goes along. Without his readings odometry is right, or what is
    # wrong with it explains the others: most steps tell it already, and so where the robot goes.
    ways = [log] if motion.is_changed else []
    likely = by_most_steps(log, options, known)
    for way in [*ways, *([] if likely is None else [likely])]:
        alone, masked, seen = checked_companion(way, reading, options.companion)
        if seen:
            without_him = _compared(replace(log, ranges=alone.ranges), masked, options, {})
            is_right = (
                not without_him.findings
                if way is log
                else is_explained(without_him.signed, options, without_him.known)
            )
            if is_right and without_him.measured >= options.min_steps:
                return units, held, without_him, seen
    return units, held, motion, []


def _compared(
    log: LaserLog, reading: ReadingOptions, options: FileCheckOptions, known: KnownSteps
) -> _Compared:
    """Compare a log; `known` are the steps that its scans have measured already, others are added."""
    signed, reversing = checked_signs(log, options.unsigned, options.steps)
    findings, stretched = find_contradictions(signed, reading, options, known), list[str]()
    moved, set_anew = checked_clock_change(log, known, options)
    if set_anew:
        signed_anew, reversing_anew = checked_signs(moved, options.unsigned, options.steps)
        found = find_contradictions(signed_anew, reading, options, known)
        if any(not finding.corrected.get("odometry", True) for finding in found):
            # A clock does not explain it: odometry that stands for a while fits best at another time, too.
            set_anew = []
        else:
            log, signed, reversing, findings = moved, signed_anew, reversing_anew, found
    if not any(finding.is_of_clocks for finding in findings):
        log, stretched = checked_stretches(log, options, known)
    log, delay = checked_delay(log, reading, known, options)
    if delay or stretched:
        signed, reversing = checked_signs(log, options.unsigned, options.steps)
        findings = find_contradictions(signed, reading, options, known)
    return _Compared(log, reading, signed, known, findings, stretched, reversing, set_anew, delay)


def _mirrored(log: LaserLog, findings: Sequence[Finding]) -> LaserLog:
    """The log whose odometry is mirrored, and agrees with the scans as findings of mirrored scans see it."""
    mount = log.mount
    for finding in findings:
        if finding.seen_scale is not None:
            log = with_scaled_odometry(log, finding.seen_scale)
        if finding.seen_mount is not None:
            mount = finding.seen_mount
    return with_mirrored_odometry(log, mount)


def _as_read(log: LaserLog, reading: ReadingOptions, corrected: ReadingOptions) -> LaserLog:
    """The log with its odometry as other reading options give it."""
    if log.odometry is None or not corrected.odometry:
        return replace(log, odometry=None, odometry_path=None)
    return with_scaled_odometry(log, corrected.odometry_scale / reading.odometry_scale)
