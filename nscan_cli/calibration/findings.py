"""What the scans contradict of their file, as sentences: the evidence, and what was or should be done."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from nscan_cli.calibration.mount_fit import MountFit, TurnFit
from nscan_cli.calibration.odometry_delay import TurnDelay
from nscan_cli.calibration.odometry_options import DelayOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.scale_change import ScaleChange
from nscan_cli.calibration.step_evidence import StepEvidence
from nscan_cli.calibration.view_change import TurnChange
from nscan_cli.files.text import counted
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import MIRRORED, Array

UNDONE = "--as-recorded uses it as it is"
AGREES = "; meanwhile odometry is changed to agree with the scans"
RANGE_UNITS = {"feet": 0.3048, "inches": 0.0254}
"""Units of ranges, in metres. Odometry that someone converted twice is off by such a factor, too."""


@dataclass(frozen=True)
class Finding:
    """Something that the file says and its scans contradict."""

    message: str
    """For the user: the evidence, and what was done or what to do."""
    corrected: dict[str, Any] = field(default_factory=dict)
    """Reading options that put it right, where it is beyond doubt."""
    seen_scale: float | None = None
    """Metres by scans for one metre by odometry, if odometry is to agree with the scans until the cause is
    known."""
    seen_mount: Array | None = None
    """(3,) the mounting of the laser that the steps show, if odometry is to agree with the scans until the
    cause is known."""
    clock_offset: float = 0.0
    """s to add to the stamps of odometry, so that its turns agree with the scans; 0 if none is known."""
    is_of_clocks: bool = False
    """Whether odometry and scans are compared at wrong times before it is put right."""
    is_of_mount: bool = False
    """Whether the laser may be elsewhere on the robot, or look elsewhere, than the file says."""
    is_mirror_image: bool = False
    """Whether odometry is the mirror image of what the scans show as they are read."""
    is_of_view: bool = False
    """Whether the laser looks elsewhere, or its readings come in another order, in a part of the log."""


def frozen_odometry(evidence: StepEvidence, what: str) -> Finding:
    """Odometry, or the part of it that `what` names, never moves."""
    seen = f"{evidence.moving} of {counted(len(evidence.laser), 'step')}"
    return _unused(f"{what} never moves, but the scans do in {seen}")


def unchanging_scans(unchanged: int, driven: int) -> Finding:
    """What the laser sees goes along with the robot."""
    return Finding(
        f"the scans stay the same while the robot drives by odometry, in {unchanged} of "
        f"{counted(driven, 'step')}: the laser likely is tilted and sees the floor, or is covered, or sees "
        "mostly the robot itself; leave out such bearings with --mask, or the map is wrong"
    )


def unexplained_positions(evidence: StepEvidence) -> Finding:
    """Nothing explains the positions."""
    return _unused(
        "odometry contradicts the scans: no scale, mounting or clock explains its positions, "
        f"in {counted(evidence.moving, 'step')} (headings in degrees?)"
    )


def unexplained_turns(turns: TurnFit) -> Finding:
    """Nothing explains the turns."""
    return _unused(
        "odometry contradicts the scans: no scale and no clock explains its turns, "
        f"in {counted(turns.steps, 'step')} (headings in degrees, or a wheel that is not counted?)"
    )


def unsteady_stamps(found: TurnDelay, steps: int, reading: ReadingOptions, options: DelayOptions) -> Finding:
    """Odometry fits at no offset of its stamps, in so many steps."""
    said, cure = f"contradicts the scans at any offset of its stamps up to {options.longest:g} s", ""
    if found.is_between and found.sigmas >= options.sigmas and abs(found.delay) >= options.least:
        late = f"{abs(found.delay):.1f} s too {'early' if found.delay > 0.0 else 'late'}"
        said = f"is stamped about {late}, and contradicts the scans even if moved"
        cure = f", with --clock-offset {reading.clock_offset + found.delay:.1f} moved by that"
    evidence = f"turns differ by {found.left:.0%}, in {counted(steps, 'step')}"
    message = f"odometry {said}: {evidence}; stamps vary, or poses come too seldom"
    return replace(_unused(message, cure), is_of_clocks=True)


def wrong_signs(evidence: StepEvidence, what: str, reading: ReadingOptions) -> Finding:
    """With the sign of `what` changed the odometry agrees."""
    return _unused(
        f"odometry counts {what} the wrong way: with the other sign its positions agree with the "
        f"scans, in {counted(evidence.moving, 'step')}",
        mirrored_instead(reading),
    )


def mirrored_instead(reading: ReadingOptions) -> str:
    """What to do if a mended sign of odometry has hidden readings in the wrong order: with another sign of
    odometry these look the same."""
    cure = "leave out --flip" if reading.flip else "try --flip"
    return (
        f"; if left and right are exchanged in the map, the readings are in the wrong order as well: {cure}"
    )


def _unused(evidence: str, cure: str = "") -> Finding:
    return Finding(f"{evidence}; it is not used; {UNDONE}{cure}", {"odometry": False})


def opposite_turns(evidence: str, reading: ReadingOptions, is_certain: bool, is_mended: bool) -> Finding:
    """Scans turn the other way than odometry. `is_certain`: the mounting shows that the readings are wrong.

    If not certain, odometry may be wrong instead: scans and odometry are then mirror images of each other.
    `is_mended`: odometry is mirrored, so that both are of one kind.
    """
    cure = "leave out --flip" if reading.flip else "try --flip"
    mended = "; odometry is mirrored as well, so that it agrees with them" if is_mended else ""
    other = (
        ""
        if is_certain
        else (
            "; if left and right are correct in the map, odometry turns the wrong way instead, and "
            f"{'the map is right' if is_mended else '--no-odometry maps it'}"
        )
    )
    return Finding(
        f"the readings are likely in the wrong order, and the map is mirrored: {evidence}{mended}; "
        f"{cure}{other}",
        is_mirror_image=is_mended,
    )


def mirrored_odometry(turns: TurnFit, mount: Array) -> Finding:
    """Odometry turns the other way than the scans, and the laser, which mirrored scans show at `mount` (3,),
    tells that the scans are right."""
    return Finding(
        f"odometry turns the wrong way: {turns_of(turns)}, and the laser is on the side that the file says; "
        f"odometry is mirrored, so that it agrees with the scans; {UNDONE}",
        seen_mount=mount,
        is_mirror_image=True,
    )


def reversed_odometry(turns: TurnFit, seen: Array, reading: ReadingOptions, is_certain: bool) -> Finding:
    """Wheels that both count backward: odometry drives and turns the other way than the scans.

    `seen` (3,) is the mounting that mirrored scans show. `is_certain`: the mounting excludes that the
    readings are in the wrong order and odometry drives the other way.
    """
    flip, scale = "leaving out --flip, and" if reading.flip else "--flip", -reading.odometry_scale
    other = (
        ""
        if is_certain
        else (
            "; if left and right are exchanged in the map, the readings are in the wrong order instead, and "
            f"odometry counts forward as backward: try {flip} --odometry-scale {scale:g}"
        )
    )
    return Finding(
        f"odometry likely counts both wheels backward: {turns_of(turns)}, and it drives backward where "
        f"they go forward; it is reversed, so that it agrees with the scans; {UNDONE}{other}",
        seen_mount=seen,
        is_mirror_image=True,
    )


def of_mirrored_scans(finding: Finding) -> Finding:
    """A finding of scans as they are, with the mounting that mirrored ones show."""
    seen = finding.seen_mount
    return finding if seen is None else replace(finding, seen_mount=seen * MIRRORED)


def turns_of(turns: TurnFit) -> str:
    """What turns are, as evidence."""
    return f"turns by odometry are {turns.ratio:.2f} times those by scans, in {counted(turns.steps, 'step')}"


def wrong_turns(turns: TurnFit) -> Finding:
    """Odometry turns too much, too little or the wrong way."""
    what = "the wrong way" if turns.ratio < 0.0 else "wrongly"
    return Finding(f"odometry likely turns {what}: {turns_of(turns)}; try --no-odometry")


def wrong_scale(
    fit: MountFit, ranges_likelier: float, reading: ReadingOptions, options: FileCheckOptions
) -> Finding:
    """Odometry counts in another unit than ranges, which are so many times as likely as it to be wrong."""
    decimal = 10.0 ** round(math.log10(fit.scale))
    is_decimal = abs(fit.scale / decimal - 1.0) <= options.decimal_tolerance
    scale = reading.odometry_scale * (decimal if is_decimal else float(f"{fit.scale:.3g}"))
    evidence = f"one metre by odometry is {fit.scale:.3g} m by scans, in {counted(fit.steps, 'step')}"
    for unit, metres in RANGE_UNITS.items():
        if abs(fit.scale * metres - 1.0) <= options.range_unit_tolerance:
            in_metres = f"--range-scale {(reading.range_scale or 1.0) * metres:g}"
            multiplied = f"positions by odometry are multiplied, as by --odometry-scale {scale:g}"
            return Finding(
                f"the ranges are likely in {unit}: {evidence}; try {in_metres}; as it is, the map is in "
                f"{unit}, unless odometry is wrong instead, and {multiplied}; {UNDONE}"
                if ranges_likelier > options.likelier_unit_factor
                else f"{evidence}: {multiplied}; if the ranges are in {unit} instead, and the map is too "
                f"large, {in_metres}; {UNDONE}",
                {"odometry_scale": scale},
            )
    ranges = f"{(reading.range_scale or 1.0) / fit.scale:.3g}"
    is_either = not is_decimal and max(fit.scale, 1.0 / fit.scale) <= options.max_range_factor
    is_clear = max(fit.scale, 1.0 / fit.scale) > options.clear_scale_factor
    if is_either and ranges_likelier > options.likelier_factor:
        length, size, speed = ("short", "small", "fast") if fit.scale < 1.0 else ("long", "large", "slow")
        return Finding(
            f"the ranges, and so the size of the map, are likely too {length}: {evidence}, and rooms "
            f"are seldom so {size}, or robots so {speed}; try --range-scale {ranges}, or --odometry-scale "
            f"{scale:g} if the size of the map is right{AGREES if is_clear else ''}",
            seen_scale=fit.scale if is_clear else None,
        )
    other = (
        f"; if the ranges, and so the size of the map, are wrong instead, --range-scale {ranges}"
        if is_either
        else ""
    )
    if max(fit.scale, 1.0 / fit.scale) > options.certain_scale_factor:
        message = (
            f"{evidence}: its positions are multiplied, as by --odometry-scale {scale:g}{other}; {UNDONE}"
        )
        return Finding(message, {"odometry_scale": scale})
    return Finding(
        f"the scale of odometry is likely wrong: {evidence}; try --odometry-scale {scale:g}{other}"
        f"{AGREES if is_clear else ''}",
        seen_scale=fit.scale if is_clear else None,
    )


class PlaceOfChange(NamedTuple):
    """Two scans between which something changes."""

    before: int
    """Number of the last scan that is surely before it."""
    behind: int
    """Number of the first scan that is surely behind it."""
    end: float
    """Time of the former from the first scan of the log, s."""
    start: float
    """Time of the latter, s."""

    def cures(self, before: str = "", behind: str = "") -> str:
        """How to map both parts, each with more options."""
        one, other = (f" {options}" if options else "" for options in (before, behind))
        return f"map each part by itself: try --end {self.end:.2f}{one}, or --start {self.start:.2f}{other}"

    def cures_of_stretch(self, last: PlaceOfChange, outside: str = "", inside: str = "") -> str:
        """How to map what is before, in and behind a stretch from here to a later place."""
        one, other = (f" {options}" if options else "" for options in (outside, inside))
        return (
            f"map each part by itself: try --end {self.end:.2f}{one}, or --start {self.start:.2f} "
            f"--end {last.end:.2f}{other}, or --start {last.start:.2f}{one}"
        )


def changed_scale(change: ScaleChange, steps: int, place: PlaceOfChange, reading: ReadingOptions) -> Finding:
    """Odometry or the ranges count otherwise from a scan on."""
    ratio = change.behind / change.before
    by_ranges = f"--range-scale {(reading.range_scale or 1.0) / ratio:.3g}"
    by_odometry = f"--odometry-scale {reading.odometry_scale * ratio:.3g}"
    return Finding(
        f"odometry or the ranges change their scale from scan {place.before} to {place.behind}: one metre by "
        f"odometry is {change.before:.3g} m by scans before and {change.behind:.3g} m behind, in "
        f"{counted(steps, 'step')}; {place.cures()}, "
        f"with {by_ranges} if the ranges are wrong there, or {by_odometry} if odometry is"
    )


def changed_order(change: TurnChange, place: PlaceOfChange, reading: ReadingOptions) -> Finding:
    """The readings come in the other order from a scan on, or odometry turns the other way."""
    as_read, otherwise = ("--flip", "") if reading.flip else ("", "--flip")
    cures = place.cures(*((as_read, otherwise) if change.before > 0.0 else (otherwise, as_read)))
    return Finding(
        f"the order of the readings likely changes from scan {place.before} to {place.behind}: turns by "
        f"odometry are {change.before:.2f} times those by scans before and {change.behind:.2f} times behind, "
        f"in {counted(change.steps, 'step')}; {cures}; if left and right are correct in both maps without "
        "--flip, odometry turns the wrong way in one of them, and --no-odometry maps all",
        is_of_view=True,
    )
