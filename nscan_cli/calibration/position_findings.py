"""What positions by odometry, and turns opposite to those of the scans, say of laser and odometry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.calibration import findings, mount_findings
from nscan_cli.calibration.findings import Finding
from nscan_cli.calibration.mount_fit import MountFit, TurnFit, is_inverse, is_nearer, is_nearer_in_direction
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.step_evidence import StepEvidence, explains_positions, is_wrong_scale
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import MIRRORED, Array, wrap

BACKWARDS = np.array([-1.0, -1.0, 1.0])
"""Factors of a mounting: of a robot that counts forward as backward the laser seems to be there, turned."""
AHEAD_REVERSED = np.array([-1.0, 1.0, 1.0])
"""Factors of a mounting."""


def of_opposite_turns(
    mount: Array,
    turns: TurnFit,
    fit: MountFit,
    evidence: StepEvidence,
    reading: ReadingOptions,
    options: FileCheckOptions,
) -> list[Finding]:
    """Readings in the wrong order, or odometry that turns the wrong way; `fit` is that of mirrored scans.

    The two are mirror images, except for the mounting: if the laser is beside the middle of the robot, or
    looks aside, its side in the file is right in only one of the two cases. Small steps aside, which may be
    of either sign, would pass for a place farther ahead or behind.
    """
    other = mount * MIRRORED
    # Its side, which is open, says nothing of ahead and behind.
    ahead = np.append(mount[0], fit.mount[1:])
    if _looks_back(mount, fit, options) and _drives_backward(ahead, ahead * AHEAD_REVERSED, fit, evidence)[0]:
        # Of mirrored scans odometry would be backward; wheels that both count backward look the same.
        of_order, of_wheels = mount * BACKWARDS, other * BACKWARDS
        if not is_nearer(fit, of_order, of_wheels, options.mount_sigmas):
            is_certain = is_nearer(fit, of_wheels, of_order, options.mount_sigmas)
            seen = np.append(of_wheels[:2], wrap(other[2] + np.pi))
            reversed_ = findings.reversed_odometry(turns, seen, reading, is_certain)
            return [reversed_, *_of_scale(fit, evidence, reading, options)]
        is_certain = True
    else:
        if is_nearer(fit, other, mount, options.mount_sigmas) or is_nearer_in_direction(
            fit, other, mount, options
        ):
            of_odometry = replace(fit, mount=fit.mount * MIRRORED)
            told = of_positions(mount, of_odometry, evidence, reading, options, False)
            return [findings.mirrored_odometry(turns, other), *map(findings.of_mirrored_scans, told)]
        is_certain = is_nearer(fit, mount, other, options.mount_sigmas) or is_nearer_in_direction(
            fit, mount, other, options
        )
    mirrored = findings.opposite_turns(findings.turns_of(turns), reading, is_certain, True)
    return [mirrored, *of_positions(mount, fit, evidence, reading, options, False)]


def of_positions(
    mount: Array,
    fit: MountFit | None,
    evidence: StepEvidence,
    reading: ReadingOptions,
    options: FileCheckOptions,
    tell_place: bool = True,
) -> list[Finding]:
    """What the positions by odometry say of its scale and of the mounting, which the file has at (3,).

    Where they do not `tell_place`, only of its direction.
    """
    if fit is None or not explains_positions(fit, options):
        return []
    found = _of_scale(fit, evidence, reading, options)
    if tell_place and evidence.turning_both >= options.min_steps and is_inverse(fit, mount, options):
        return [*found, mount_findings.inverse_mounting(mount, fit)]
    if _looks_back(mount, fit, options):
        return [*found, _opposite(mount, fit, evidence, reading, options)]
    mounting = mount_findings.wrong_mounting(mount, fit, evidence.turning_both, options, tell_place)
    return found if mounting is None else [*found, mounting]


def _of_scale(
    fit: MountFit, evidence: StepEvidence, reading: ReadingOptions, options: FileCheckOptions
) -> list[Finding]:
    if not is_wrong_scale(fit, options):
        return []
    return [findings.wrong_scale(fit, evidence.ranges_over_odometry(fit.scale), reading, options)]


def _looks_back(mount: Array, fit: MountFit, options: FileCheckOptions) -> bool:
    """Whether the laser seems to look the other way than at its mounting (3,)."""
    return abs(float(wrap(fit.mount[2] - mount[2]))) > np.pi - options.opposite_within


def _opposite(
    mount: Array, fit: MountFit, evidence: StepEvidence, reading: ReadingOptions, options: FileCheckOptions
) -> Finding:
    """A laser that looks back, or odometry that counts forward as backward."""
    is_backward, why = _drives_backward(mount, mount * BACKWARDS, fit, evidence)
    return mount_findings.opposite_directions(mount, fit, why, is_backward, reading, options)


def _drives_backward(
    forward_at: Array, backward_at: Array, fit: MountFit, evidence: StepEvidence
) -> tuple[bool, str]:
    """Whether odometry counts forward as backward where the laser seems to look back, and the reason.

    The place of the laser decides, if it is ahead of the robot's middle or behind it: at `forward_at` (3,) it
    looks back, at `backward_at` odometry does so. Otherwise the robot is assumed to drive mostly forward.
    """
    sigmas, forward = evidence.options.mount_sigmas, evidence.forward_share
    is_backward = is_nearer(fit, backward_at, forward_at, sigmas)
    if is_backward or is_nearer(fit, forward_at, backward_at, sigmas):
        return is_backward, "the laser is where the file says"
    return forward < 0.5, f"{forward:.0%} of the steps by odometry go forward"
