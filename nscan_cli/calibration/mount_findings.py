"""Messages on a laser that is, or seems to be, mounted otherwise than the file says."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from nscan_cli.calibration.findings import AGREES, Finding, PlaceOfChange
from nscan_cli.calibration.mount_fit import MountFit, is_nearer
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.step_evidence import is_wrong_scale
from nscan_cli.calibration.view_change import DirectionChange
from nscan_cli.files.text import counted
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, inverse, transform, wrap


def changed_direction(
    change: DirectionChange, places: Sequence[PlaceOfChange], mount: Array, options: FileCheckOptions
) -> Finding:
    """The laser, at `mount` (3,) by the file, looks elsewhere from a place on, or between two of them."""
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
    place = places[0]
    where = f"behind a place from scan {place.before} to {place.behind} than before"
    cures = place.cures(*mounts)
    if len(places) > 1:
        last = places[1]
        where = (
            f"from a place from scan {place.before} to {place.behind} on until one from {last.before} to "
            f"{last.behind} than elsewhere"
        )
        cures = place.cures_of_stretch(last, *mounts)
    return Finding(
        f"the laser looks {abs(turn):.0f}° further to the {side} {where}, in "
        f"{counted(change.steps, 'step')}: it was turned, or its bearings are "
        f"counted from elsewhere{other}; {cures}",
        is_of_view=True,
    )


def wrong_mounting(
    mount: Array, fit: MountFit, turning: int, options: FileCheckOptions, tell_place: bool = True
) -> Finding | None:
    """The laser is elsewhere than in the file, at `mount` (3,), or looks elsewhere; None if it does not.

    Of the steps, `turning` are some with a turn by scans and by odometry: only these tell its place. Without
    `tell_place` none do.
    """
    off, sigmas = fit.mount - mount, options.mount_sigmas
    turn = float(wrap(off[2]))
    is_turned = abs(turn) > max(options.min_mount_turn, sigmas * float(fit.sigmas[3]))
    is_moved = bool((np.abs(off[:2]) > np.maximum(options.min_mount_move, sigmas * fit.sigmas[1:3])).any())
    # Lengths tell nothing as long as it is open whose metre is wrong, nor do a few steps.
    is_moved &= fit.steps >= options.min_steps_to_exclude and not is_wrong_scale(fit, options)
    is_moved &= tell_place and turning >= options.min_steps
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


def inverse_mounting(mount: Array, fit: MountFit) -> Finding:
    """The mounting in the file, at `mount` (3,), is that of the robot as the laser sees it."""
    seen = inverse(mount)
    x, y = (f"{part:g}" for part in (np.round(seen[:2], 4) + 0.0).tolist())
    return Finding(
        "the mounting in the file is likely the wrong way round, that of the robot as the laser sees it: "
        f"with its inverse scans and odometry agree about {counted(fit.steps, 'step')}; try "
        f"--mount {x},{y},{_degrees(float(seen[2]))}{AGREES}",
        seen_mount=seen,
        is_of_mount=True,
    )


def opposite_directions(
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
    """The mounting (3,) that the steps show; if they leave open where the laser is, it is at the `place` (3,)
    of a mounting."""
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
