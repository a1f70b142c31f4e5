"""The turn of the laser as its file has it, against the scans: its direction, and whether it turns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.calibration.calibrated_reading import DECIMALS
from nscan_cli.calibration.odometry_delay import odometry_delay, with_delay
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.scan_motion import ScanMotion
from nscan_cli.calibration.sweep_evidence import SweepEvidence, sweep_evidence
from nscan_cli.files.text import counted
from nscan_cli.logs.field_of_view import field_of_view
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.sweep import beam_times


def checked_sweep(
    log: LaserLog, reading: ReadingOptions, options: FileCheckOptions
) -> tuple[LaserLog, ReadingOptions, list[str]]:
    """The log with the times of beams that its scans tell, the options that read it so, and what is said.

    A time that the file tells may be of readings in the reverse order, or of a laser that sees at once. A
    file that tells none may be of a laser that turns once from scan to scan. Where the scans do not say so
    beyond doubt, all stays as it is.
    """
    if reading.as_recorded or reading.sweep is not None or len(log) < options.sweep.min_scans:
        return log, reading, []
    told = _turn_of(log)
    turn = _likely_turn(log, options) if told == 0.0 else told
    if turn == 0.0:
        return log, reading, []
    motion = ScanMotion.of_log(log, options.steps, options.sweep)
    evidence = sweep_evidence(motion, (0.0, turn, -turn), told, options.sweep)
    sharpest, said = evidence.sharpest, list[str]()
    certainty = evidence.sigmas(sharpest, told)
    if sharpest != told and certainty >= options.sweep.sigmas:
        reading = replace(reading, sweep=round(sharpest, DECIMALS) + 0.0)
        turns = np.full(len(log), reading.sweep)
        times = beam_times(turns, log.angle_increment, log.beam_counts(), reading.stamp)
        said.append(_said(evidence, told, sharpest, certainty))
        log = replace(log, beam_times=times)
    delay = odometry_delay(log, motion, options.sweep)
    if delay:
        log, reading = with_delay(log, delay), replace(reading, clock_offset=reading.clock_offset + delay)
        said.append(_said_late(delay, reading.clock_offset))
    return log, reading, said


def _turn_of(log: LaserLog) -> float:
    """The usual time of a turn as the file has it, s; 0 if it has none."""
    if log.beam_times is None:
        return 0.0
    return float(np.median(log.beam_times.step * 2 * np.pi / np.abs(log.angle_increment)))


def _likely_turn(log: LaserLog, options: FileCheckOptions) -> float:
    """The time from scan to scan, s, if the laser looks around as those do that turn; else 0."""
    first, last, _ = field_of_view(log)
    period = float(np.median(np.diff(log.times)))
    is_wide = abs(last - first) >= options.sweep.min_view
    return period if is_wide and options.sweep.shortest <= period <= options.sweep.longest else 0.0


def _said(evidence: SweepEvidence, told: float, sharpest: float, certainty: float) -> str:
    compared = counted(len(evidence.energies), "pair")
    pairs = f"{compared} of scans fit better so, by {certainty:.1f} standard deviations"
    flag, order = f"{sharpest:.3g}", ", readings in the reverse order" if sharpest < 0.0 else ""
    if sharpest == 0.0:
        what, flag = "the laser sees all beams at once, though the file has times of beams", "off"
    elif told == 0.0:
        what = f"the laser turns for {abs(sharpest):.3g} s{order}, though the file has no times of beams"
    else:
        what = "the readings are in the reverse order of time"
    return f"{what}: {pairs}; they are read so, as by --sweep {flag}; --as-recorded believes the file"


def _said_late(delay: float, offset: float) -> str:
    side = "early" if delay > 0.0 else "late"
    return (
        f"odometry is stamped {abs(delay):.2g} s too {side}, as its turns are against those of the scans; "
        f"it is moved, as by --clock-offset {offset:.2g}, since beams are corrected by it; "
        "--as-recorded believes the file"
    )
