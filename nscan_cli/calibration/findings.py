"""What the scans contradict of their file, as sentences: the evidence, and what was or should be done."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from nscan_cli.calibration.mount_fit import MountFit, TurnFit
from nscan_cli.calibration.odometry_clock import ClockLag
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.scale_change import ScaleChange
from nscan_cli.calibration.step_evidence import StepEvidence, is_nearer, is_wrong_scale
from nscan_cli.calibration.view_change import DirectionChange, TurnChange
from nscan_cli.files.text import counted
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, transform, wrap

UNDONE = "--as-recorded uses it as it is"
AGREES = "; meanwhile odometry is changed to agree with the scans"
RANGE_UNITS = {"feet": 0.3048, "inches": 0.0254}
"""Units in metres that ranges come in, and that no odometry is so much larger than."""


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
    is_of_clocks: bool = False
    """Whether odometry and scans are compared at wrong times before it is put right."""
    is_of_mount: bool = False
    """Whether the laser may be elsewhere on the robot, or look elsewhere, than the file says."""
    is_mirror_image: bool = False
    """Whether odometry is the mirror image of what the scans show as they are read."""
    is_of_view: bool = False
    """Whether the laser looks elsewhere, or its readings come in another order, in a part of the log."""


def frozen(evidence: StepEvidence, what: str) -> Finding:
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


def excluded(evidence: StepEvidence) -> Finding:
    """Nothing explains the positions."""
    return _unused(
        "odometry contradicts the scans: no scale, mounting or clock explains its positions, "
        f"in {counted(evidence.moving, 'step')} (headings in degrees?)"
    )


def excluded_turns(turns: TurnFit) -> Finding:
    """Nothing explains the turns."""
    return _unused(
        "odometry contradicts the scans: no scale and no clock explains its turns, "
        f"in {counted(turns.steps, 'step')} (headings in degrees, or a wheel that is not counted?)"
    )


def wrong_signs(evidence: StepEvidence, what: str) -> Finding:
    """With the sign of `what` changed the odometry agrees."""
    return _unused(
        f"odometry counts {what} the wrong way: with the other sign its positions agree with the "
        f"scans, in {counted(evidence.moving, 'step')}"
    )


def _unused(evidence: str) -> Finding:
    return Finding(f"{evidence}; it is not used; {UNDONE}", {"odometry": False})


def two_clocks(lag: ClockLag, reading: ReadingOptions) -> Finding:
    """Odometry is stamped by another clock."""
    side = "behind" if lag.offset > 0 else "ahead of"
    return Finding(
        f"the clock of odometry is likely {abs(lag.offset):.1f} s {side} that of the scans: with this offset "
        f"their turns differ by {lag.disagreement:.0%}, as stamped by {lag.as_stamped:.0%}; "
        f"try --clock-offset {reading.clock_offset + lag.offset:.1f}",
        is_of_clocks=True,
    )


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
            "; if left and right are correct in the map, odometry turns the wrong way instead, and the map "
            "is right, also with --no-odometry"
        )
    )
    return Finding(
        f"the readings are likely in the wrong order, and the map is mirrored: {evidence}{mended}; "
        f"{cure}{other}",
        is_mirror_image=is_mended,
    )


def turns_of(turns: TurnFit) -> str:
    """What turns are, as evidence."""
    return f"turns by odometry are {turns.ratio:.2f} times those by scans, in {counted(turns.steps, 'step')}"


def wrong_turns(turns: TurnFit) -> Finding:
    """Odometry turns too much, too little or the wrong way."""
    what = "the wrong way" if turns.ratio < 0.0 else "wrongly"
    return Finding(f"odometry likely turns {what}: {turns_of(turns)}; try --no-odometry")


def wrong_scale(fit: MountFit, reading: ReadingOptions, options: FileCheckOptions) -> Finding:
    """Odometry counts in another unit than the ranges, beyond doubt or likely."""
    decimal = 10.0 ** round(math.log10(fit.scale))
    is_decimal = abs(fit.scale / decimal - 1.0) <= options.decimal_tolerance
    scale = reading.odometry_scale * (decimal if is_decimal else float(f"{fit.scale:.3g}"))
    evidence = f"one metre by odometry is {fit.scale:.3g} m by scans, in {counted(fit.steps, 'step')}"
    for unit, metres in RANGE_UNITS.items():
        if abs(fit.scale * metres - 1.0) <= options.range_unit_tolerance:
            return Finding(
                f"the ranges are likely in {unit}: {evidence}; try --range-scale "
                f"{(reading.range_scale or 1.0) * metres:g}; as it is, the map is in {unit}, and "
                f"positions by odometry are multiplied, as by --odometry-scale {scale:g}; {UNDONE}",
                {"odometry_scale": scale},
            )
    ranges = f"{(reading.range_scale or 1.0) / fit.scale:.3g}"
    is_either = not is_decimal and max(fit.scale, 1.0 / fit.scale) <= options.max_range_factor
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
    is_clear = max(fit.scale, 1.0 / fit.scale) > options.clear_scale_factor
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


def changed_direction(
    change: DirectionChange, place: PlaceOfChange, mount: Array, options: FileCheckOptions
) -> Finding:
    """The laser, at `mount` (3,) by the file, looks elsewhere from a scan on."""
    turn = math.degrees(float(wrap(change.behind - change.before)))
    side = "left" if turn > 0 else "right"
    mounts = [
        f"--mount {mount[0]:g},{mount[1]:g},{_degrees(_round_angle(angle, options))}"
        if abs(float(wrap(angle - mount[2]))) > options.min_mount_turn
        else ""
        for angle in (change.before, change.behind)
    ]
    is_opposite = abs(turn) > 180.0 - math.degrees(options.opposite_within)
    other = ", or odometry counts forward as backward in one of them" if is_opposite else ""
    return Finding(
        f"the laser looks {abs(turn):.0f}° further to the {side} behind a place from scan {place.before} to "
        f"{place.behind} than before, in {counted(change.steps, 'step')}: it was turned, or its bearings are "
        f"counted from elsewhere{other}; {place.cures(*mounts)}",
        is_of_view=True,
    )


def wrong_mounting(mount: Array, fit: MountFit, turning: int, options: FileCheckOptions) -> Finding | None:
    """The laser is elsewhere than in the file, at `mount` (3,), or looks elsewhere; None if it does not.

    Of the steps, `turning` are some with a turn by scans and by odometry: only these tell its place.
    """
    off, sigmas = fit.mount - mount, options.mount_sigmas
    turn = float(wrap(off[2]))
    is_turned = abs(turn) > max(options.min_mount_turn, sigmas * float(fit.sigmas[3]))
    is_moved = bool((np.abs(off[:2]) > np.maximum(options.min_mount_move, sigmas * fit.sigmas[1:3])).any())
    # Lengths tell nothing as long as it is open whose metre is wrong, nor do a few steps.
    is_moved &= fit.steps >= options.min_steps_to_exclude and not is_wrong_scale(fit, options)
    is_moved &= turning >= options.min_steps
    if not is_turned and not is_moved:
        return None
    place = np.round(fit.mount[:2], 2) + 0.0 if is_moved else mount[:2]
    x, y = (f"{part:g}" for part in place.tolist())
    angle = _degrees(_round_angle(fit.mount[2], options) if is_turned else mount[2])
    agree = f"then scans and odometry agree about {counted(fit.steps, 'step')}"
    cure = f"try --mount {x},{y},{angle}"
    if not is_turned:
        along = f"{off[0]:+.2f} m ahead and {off[1]:+.2f} m to the left"
        what = f"the laser is likely elsewhere on the robot than the file says, by {along}"
        return Finding(f"{what}; {agree}; {cure}", is_of_mount=True)
    side, other = ("left", "right") if turn > 0 else ("right", "left")
    degrees = f"{abs(math.degrees(turn)):.0f}°"
    # Seen from a robot that is turned, the laser is elsewhere, too.
    turned = np.array([*transform(np.array([0.0, 0.0, turn]), mount[:2]), mount[2] + turn])
    headings = f"the headings of odometry are likely {degrees} too far to the {other}"
    is_heading = is_nearer(fit, turned, mount, sigmas)
    seen = _seen_mount(fit, turned if is_heading else mount, options)
    if is_heading:
        return Finding(f"{headings}; {agree}; try --no-odometry{AGREES}", seen_mount=seen, is_of_mount=True)
    if not is_nearer(fit, mount, turned, sigmas):
        # Near the middle of the robot both look the same.
        cure += f", or --no-odometry if the headings of odometry are {degrees} too far to the {other}"
    what = f"the laser likely looks {degrees} further to the {side} than the file says"
    return Finding(f"{what}; {agree}; {cure}{AGREES}", seen_mount=seen, is_of_mount=True)


def opposite(
    mount: Array,
    fit: MountFit,
    evidence: str,
    is_odometry: bool,
    reading: ReadingOptions,
    options: FileCheckOptions,
) -> Finding:
    """Odometry counts forward as backward, or the laser looks back; `evidence` says why it is this one.

    `mount` (3,) is the mounting in the file.
    """
    angle = _degrees(_round_angle(fit.mount[2], options))
    by_mount = f"--mount {mount[0]:g},{mount[1]:g},{angle}"
    by_scale = f"--odometry-scale {-reading.odometry_scale:g}"
    if is_odometry:
        what, other = "odometry likely counts forward as backward", "the laser looks back"
        cures = by_scale, by_mount
    else:
        what = "the laser likely looks 180° further to the left than the file says"
        other, cures = "odometry counts forward as backward", (by_mount, by_scale)
    agree = f"then scans and odometry agree about {counted(fit.steps, 'step')}, and {evidence}"
    seen = _seen_mount(fit, -mount if is_odometry else mount, options)
    message = f"{what}; {agree}; try {cures[0]}, or {cures[1]} if {other}{AGREES}"
    return Finding(message, seen_mount=seen, is_of_mount=True)


def _seen_mount(fit: MountFit, place: Array, options: FileCheckOptions) -> Array:
    """The mounting (3,) that the steps show; at a place (2,) or more, if they leave that open."""
    is_told = float(fit.sigmas[1:3].max()) <= options.max_seen_sigma
    return np.append(fit.mount[:2] if is_told else place[:2], fit.mount[2])


def _round_angle(angle: float, options: FileCheckOptions) -> float:
    """A measured angle of a mounting (rad), rounded to one that lasers are mounted at, or to a degree."""
    rounded = options.round_angle * round(angle / options.round_angle)
    is_near = abs(rounded - angle) <= options.round_angle_tolerance
    return rounded if is_near else math.radians(round(math.degrees(angle)))


def _degrees(angle: float) -> str:
    # −180° and 180° are one direction.
    return f"{math.degrees(float(wrap(angle))):g}"
