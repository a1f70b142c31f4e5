"""Scans against their file: what it says of odometry, mounting and clocks that they contradict."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from nscan_cli.calibration.held_odometry import checked_held
from nscan_cli.calibration.measured_steps import MeasuredSteps, measure_steps
from nscan_cli.calibration.mount_fit import MountFit, TurnFit, fit_mount, fit_turns
from nscan_cli.calibration.odometry_clock import ClockLag, clock_lag
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.step_sampling import telling_steps
from nscan_cli.calibration.sweep_check import checked_sweep
from nscan_cli.files.text import counted
from nscan_cli.logs.assemble import scaled_odometry
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_path import robot_path
from nscan_cli.poses import MIRRORED, Array, are_known, relative, wrap

ROUND_ANGLE, ROUND_WITHIN = 15.0, 3.0
"""Degrees: lasers are mounted at round angles; a measured one this near to one is that."""
REVERSED = np.array([-1.0, 1.0, 1.0])
"""Factors of odometry that counts x the wrong way; with y it is the same, seen from behind."""
UNDONE = "--as-recorded uses it as it is"


@dataclass(frozen=True)
class Finding:
    """Something that the file says and its scans contradict."""

    message: str
    """For the user: the evidence, and what was done or what to do."""
    corrected: dict[str, Any] = field(default_factory=dict)
    """Reading options that put it right, where it is beyond doubt."""


@dataclass(frozen=True)
class CheckedFile:
    """A log with what was put right."""

    log: LaserLog
    reading: ReadingOptions
    """The options that read the log as it is now."""
    messages: list[str]


def checked_file(log: LaserLog, reading: ReadingOptions, options: FileCheckOptions) -> CheckedFile:
    """Check a log that was read with these options, and put right what is beyond doubt."""
    log, reading, said = checked_sweep(log, reading, options)
    if reading.as_recorded:
        return CheckedFile(log, reading, said)
    findings = find_contradictions(log, reading, options)
    if not findings:
        # A clock that is behind makes odometry begin late, as if it stood.
        log, messages = checked_held(log, options.held, options.steps)
        return CheckedFile(log, reading, said + messages)
    for finding in findings:
        if finding.corrected:
            corrected = replace(reading, **finding.corrected)
            log, reading = _as_read(log, reading, corrected), corrected
    return CheckedFile(log, reading, said + [finding.message for finding in findings])


def _as_read(log: LaserLog, reading: ReadingOptions, corrected: ReadingOptions) -> LaserLog:
    """The log with its odometry as other reading options give it."""
    odometry, path = log.odometry, log.odometry_path
    if odometry is None or not corrected.odometry:
        return replace(log, odometry=None, odometry_path=None)
    scale = corrected.odometry_scale / reading.odometry_scale
    if path is not None:
        path = robot_path(path.times, scaled_odometry(path.poses, scale))
    return replace(log, odometry=scaled_odometry(odometry, scale), odometry_path=path)


def find_contradictions(log: LaserLog, reading: ReadingOptions, options: FileCheckOptions) -> list[Finding]:
    """What the scans of a log contradict; empty without odometry, and where the scans tell too little."""
    if log.odometry is None:
        return []
    evidence = _Evidence(log, measure_steps(log, telling_steps(log, options.steps), options.steps), options)
    if evidence.moving < options.min_steps:
        return []
    if _never_moves(log.odometry, options.still):
        return [_frozen(evidence)]
    turns = evidence.turns()
    if turns is not None and not _agree(turns, options):
        lag = _offset_of_clocks(log, evidence.steps, options)
        if lag is not None:
            return [_two_clocks(lag, reading)]
    fit, mirrored = evidence.fit(mirrored=False), evidence.fit(mirrored=True)
    if _is_excluded(fit, options) and _is_excluded(mirrored, options):
        return [_excluded(evidence)]
    if not _explains(fit, options) and _explains(evidence.fit_reversed(), options):
        return [_reversed(evidence)]
    found = []
    if turns is not None and turns.steps >= options.min_steps and turns.spread <= options.max_spread:
        if turns.ratio < 0.0 and _agree(turns, options) and _explains(mirrored, options):
            found.append(_mirrored(turns, reading))
            fit = mirrored
        elif not _agree(turns, options) or turns.ratio < 0.0:
            found.append(_wrong_turns(turns))
    return found if fit is None else found + _of_positions(log, fit, reading, options)


def _explains(fit: MountFit | None, options: FileCheckOptions) -> bool:
    """Whether a mounting and a scale explain the positions."""
    return fit is not None and fit.spread <= options.max_spread and fit.tail <= options.max_tail


def _is_excluded(fit: MountFit | None, options: FileCheckOptions) -> bool:
    """Whether no mounting and no scale comes near to explaining the positions."""
    return (
        fit is not None and fit.steps >= options.min_steps_to_exclude and fit.spread > options.excluded_spread
    )


class _Evidence:
    """The steps by scans and by odometry, of those that have both."""

    def __init__(self, log: LaserLog, steps: MeasuredSteps, options: FileCheckOptions) -> None:
        assert log.odometry is not None
        self.steps, self.options = steps, options
        odometry = steps.odometry(log.odometry)
        self._poses, self._known = log.odometry, are_known(odometry)
        laser, self.odometry = steps.laser[self._known], odometry[self._known]
        self.laser, least = laser, options.steps.min_motion
        self._is_moving = (np.hypot(laser[:, 0], laser[:, 1]) >= least) | (np.abs(laser[:, 2]) >= least)

    @property
    def moving(self) -> int:
        """The number of steps with motion by scans."""
        return int(self._is_moving.sum())

    def turns(self) -> TurnFit | None:
        return fit_turns(self.laser, self.odometry, self.options.steps.min_motion)

    def fit(self, mirrored: bool) -> MountFit | None:
        """The mounting and the scale that explain the steps with motion."""
        laser = self.laser[self._is_moving] * (MIRRORED if mirrored else 1.0)
        return fit_mount(laser, self.odometry[self._is_moving], self.options.steps.metres_per_radian)

    def fit_reversed(self) -> MountFit | None:
        """The fit with odometry that counts along one axis the other way."""
        odometry = self.steps.odometry(self._poses * REVERSED)[self._known][self._is_moving]
        return fit_mount(self.laser[self._is_moving], odometry, self.options.steps.metres_per_radian)


def _never_moves(odometry: Array, still: float) -> bool:
    known = odometry[are_known(odometry)]
    return bool((np.abs(relative(known, known[0])) < still).all())


def _agree(turns: TurnFit, options: FileCheckOptions) -> bool:
    """Whether turns by odometry and by scans are of the same size."""
    return turns.spread <= options.max_spread and abs(abs(turns.ratio) - 1.0) <= options.max_turn_error


def _offset_of_clocks(log: LaserLog, steps: MeasuredSteps, options: FileCheckOptions) -> ClockLag | None:
    """The offset of the odometry's clock, if it explains why turns disagree.

    Few steps agree at some offset by chance. So more are measured, unless these agree best without any.
    """
    first = clock_lag(log, steps, options.clock)
    if first is None or abs(first.offset) < options.clock.min_offset:
        return None
    more = telling_steps(log, options.steps, options.more_steps)
    steps = measure_steps(log, more, options.steps)
    lag = clock_lag(log, steps, options.clock)
    if lag is None or abs(lag.offset) < options.clock.min_offset:
        return None
    is_better = lag.disagreement < options.clock.gain * min(lag.as_stamped, lag.elsewhere)
    return lag if is_better else None


def _frozen(evidence: _Evidence) -> Finding:
    seen = f"{evidence.moving} of {counted(len(evidence.laser), 'step')}"
    message = f"odometry never moves, but the scans do in {seen}: it is not used; {UNDONE}"
    return Finding(message, {"odometry": False})


def _two_clocks(lag: ClockLag, reading: ReadingOptions) -> Finding:
    side = "behind" if lag.offset > 0 else "ahead of"
    return Finding(
        f"the clock of odometry is likely {abs(lag.offset):.1f} s {side} that of the scans: with this offset "
        f"their turns differ by {lag.disagreement:.0%}, as stamped by {lag.as_stamped:.0%}; "
        f"try --clock-offset {reading.clock_offset + lag.offset:.1f}"
    )


def _mirrored(turns: TurnFit, reading: ReadingOptions) -> Finding:
    cure = "leave out --flip" if reading.flip else "try --flip"
    return Finding(
        "the readings are likely in the wrong order, and the map is mirrored: turns by odometry are "
        f"{turns.ratio:.2f} times those by scans, in {counted(turns.steps, 'step')}; {cure}, or "
        "--no-odometry if odometry turns the wrong way"
    )


def _wrong_turns(turns: TurnFit) -> Finding:
    return Finding(
        f"odometry likely turns wrongly: its turns are {turns.ratio:.2f} times those by scans, "
        f"in {counted(turns.steps, 'step')}; try --no-odometry"
    )


def _of_positions(
    log: LaserLog, fit: MountFit, reading: ReadingOptions, options: FileCheckOptions
) -> list[Finding]:
    """What the positions by odometry say of its scale and of the mounting."""
    if not _explains(fit, options):
        return []
    found = []
    if max(fit.scale, 1.0 / fit.scale) > options.min_scale_factor:
        found.append(_wrong_scale(fit, reading, options))
    off = float(wrap(fit.mount[2] - log.mount[2]))
    if abs(off) > options.min_mount_turn:
        found.append(_wrong_mount(log.mount, fit, off))
    return found


def _excluded(evidence: _Evidence) -> Finding:
    message = (
        "odometry contradicts the scans: no scale, mounting or clock explains its positions, "
        f"in {counted(evidence.moving, 'step')}; it is not used; {UNDONE}"
    )
    return Finding(message, {"odometry": False})


def _reversed(evidence: _Evidence) -> Finding:
    message = (
        "odometry counts x or y the wrong way: with one of them reversed its positions agree with the scans, "
        f"in {counted(evidence.moving, 'step')}; it is not used; {UNDONE}"
    )
    return Finding(message, {"odometry": False})


def _wrong_scale(fit: MountFit, reading: ReadingOptions, options: FileCheckOptions) -> Finding:
    decimal = 10.0 ** round(math.log10(fit.scale))
    is_decimal = abs(fit.scale / decimal - 1.0) <= options.decimal_tolerance
    scale = reading.odometry_scale * (decimal if is_decimal else float(f"{fit.scale:.3g}"))
    evidence = f"one metre by odometry is {fit.scale:.3g} m by scans, in {counted(fit.steps, 'step')}"
    if max(fit.scale, 1.0 / fit.scale) > options.certain_scale_factor:
        message = f"{evidence}: its positions are multiplied, as by --odometry-scale {scale:g}; {UNDONE}"
        return Finding(message, {"odometry_scale": scale})
    return Finding(f"the scale of odometry is likely wrong: {evidence}; try --odometry-scale {scale:g}")


def _wrong_mount(mount: Array, fit: MountFit, off: float) -> Finding:
    angle = math.degrees(fit.mount[2])
    rounded = ROUND_ANGLE * round(angle / ROUND_ANGLE)
    angle = rounded if abs(rounded - angle) <= ROUND_WITHIN else round(angle)
    # −180° and 180° are one direction.
    angle = math.degrees(float(wrap(math.radians(angle))))
    x, y = (f"{part:g}" for part in mount[:2].tolist())
    is_opposite = abs(off) > math.pi - 0.1
    opposite = ", or --no-odometry if it counts forward as backward" if is_opposite else ""
    side = "left" if off > 0 else "right"
    cure = f"--mount {x},{y},{angle:g}{opposite}"
    return Finding(
        f"the laser likely looks {abs(math.degrees(off)):.0f}° further to the {side} than the file "
        f"says; then scans and odometry agree about {counted(fit.steps, 'step')}; try {cure}"
    )
