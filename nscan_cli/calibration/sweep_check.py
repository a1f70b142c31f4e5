"""The check of the laser's sweep in the file against the scans: its direction, and whether there is one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.calibration.calibrated_reading import DECIMALS
from nscan_cli.calibration.file_sweep import file_sweep_times, stamp_place, usual_sweep_time, with_sweep_times
from nscan_cli.calibration.moved_stamps import with_delay
from nscan_cli.calibration.odometry_delay import said_late
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.scan_motion import ScanMotion
from nscan_cli.calibration.sweep_delay import sweep_delay
from nscan_cli.calibration.sweep_evidence import SweepEvidence, sweep_evidence
from nscan_cli.calibration.sweep_time import sweep_time
from nscan_cli.files.text import counted
from nscan_cli.logs.field_of_view import field_of_view
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions


def checked_sweep(
    log: LaserLog, reading: ReadingOptions, options: FileCheckOptions
) -> tuple[LaserLog, ReadingOptions, list[str]]:
    """The log with the times of beams that its scans show, the options that read it so, and messages.

    The file may have times for readings in the reverse order, or for a laser that sees at once. It may have
    none though there is a sweep, for the whole time from scan to scan or for a part of it. If the scans do
    not show this beyond doubt, nothing changes.
    """
    if reading.as_recorded or reading.sweep is not None or len(log) < options.sweep.min_scans:
        return log, reading, []
    told = usual_sweep_time(log)
    longest = abs(told) or _longest_sweep(log, options)
    if longest == 0.0:
        return log, reading, []
    motion, said = ScanMotion.of_log(log, options.steps, options.sweep), list[str]()
    tried = (0.0, longest, -longest) if told else (0.0, longest, -longest, 0.5 * longest, -0.5 * longest)
    evidence = sweep_evidence(motion, tried, told, options.sweep)
    if told and evidence.is_little:
        # If the time is short, the robot turns little in it, and the scans still tell.
        finer = replace(options.sweep, min_winding=options.sweep.least_winding)
        evidence = sweep_evidence(motion, tried, told, finer)
    sharpest = evidence.sharpest
    certainty = evidence.sigmas(sharpest, told)
    if sharpest != told and certainty >= options.sweep.sigmas:
        sweep = sharpest if told else _measured_sweep(log, float(np.copysign(longest, sharpest)), options)
        reading = replace(reading, sweep=round(sweep, DECIMALS) + 0.0)
        log = with_sweep_times(log, np.full(len(log), reading.sweep), reading.stamp)
        said.append(_said(evidence, told, sweep, certainty))
    delay = sweep_delay(log, motion, options.sweep)
    if delay:
        log, reading, late = _without_delay(log, reading, delay, options)
        said.append(late)
    return log, reading, said


def _measured_sweep(log: LaserLog, whole: float, options: FileCheckOptions) -> float:
    """The time of a sweep by the scans, s, if it is not 0; in doubt all of that from scan to scan."""
    steps = replace(options.steps, max_beams=options.sweep.time.max_beams)
    found = sweep_time(ScanMotion.of_log(log, steps, options.sweep), abs(whole), options.sweep)
    return found.believed(whole, abs(whole), options.sweep.sigmas) or whole


def _without_delay(
    log: LaserLog, reading: ReadingOptions, delay: float, options: FileCheckOptions
) -> tuple[LaserLog, ReadingOptions, str]:
    """The log whose odometry, stamped too early by `delay` (s), is put right; how it is read, and what is
    said.

    Scans that are stamped at their middle or last beam look like that.
    """
    place = None if reading.clock_offset else stamp_place(log, reading.stamp, delay, options.sweep)
    if place is None:
        reading = replace(reading, clock_offset=reading.clock_offset + delay)
        why = "because beams are corrected by odometry"
        return with_delay(log, delay), reading, said_late(delay, reading.clock_offset, why)
    said = (
        f"scans are stamped at their {place} beam: if it were the {reading.stamp} one, they would turn "
        f"{abs(delay):.2g} s {'later' if delay > 0.0 else 'earlier'} than odometry; they are read that way, "
        f"as with --stamp {place}; --as-recorded believes the file"
    )
    return with_sweep_times(log, file_sweep_times(log), place), replace(reading, stamp=place), said


def _longest_sweep(log: LaserLog, options: FileCheckOptions) -> float:
    """The time from scan to scan, s, if the laser looks around as those do that sweep; else 0."""
    first, last, _ = field_of_view(log)
    period = float(np.median(np.diff(log.times)))
    is_wide = abs(last - first) >= options.sweep.min_view
    return period if is_wide and options.sweep.shortest <= period <= options.sweep.longest else 0.0


def _said(evidence: SweepEvidence, told: float, sweep: float, certainty: float) -> str:
    compared = counted(len(evidence.energies), "pair")
    pairs = f"{compared} of scans match better that way, by {certainty:.1f} standard deviations"
    flag, order = f"{sweep:.3g}", ", readings in the reverse order" if sweep < 0.0 else ""
    if sweep == 0.0:
        what, flag = "the laser sees all beams at once, though the file has times of beams", "off"
    elif told == 0.0:
        what = f"the laser turns for {abs(sweep):.3g} s{order}, though the file has no times of beams"
    else:
        what = "the readings are in the reverse order of time"
    return f"{what}: {pairs}; they are read that way, as with --sweep {flag}; --as-recorded believes the file"
