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
    longest = abs(told) or _time_between_scans(log, options)
    if longest == 0.0:
        return log, reading, []
    motion, said = ScanMotion.of_log(log, options.steps, options.sweep), list[str]()
    tried: tuple[float, ...] = (0.0, longest, -longest, 0.5 * longest, -0.5 * longest)
    if told:
        tried = _times_beside(log, told, options)
    evidence = sweep_evidence(motion, tried, told, options.sweep)
    if told and evidence.is_little:
        # If the time is short, the robot turns little in it, and the scans still tell.
        finer = replace(options.sweep, min_winding=options.sweep.least_winding)
        evidence = sweep_evidence(motion, tried, told, finer)
    elif not told and _is_in_doubt(evidence, options):
        steps = replace(options.steps, max_beams=options.sweep.time.max_beams)
        closer = replace(options.sweep, pairs=options.sweep.time.pairs)
        evidence = sweep_evidence(ScanMotion.of_log(log, steps, closer), tried, told, closer)
    sweep, how = _sweep_by_scans(log, evidence, told, options)
    if sweep != told:
        reading = replace(reading, sweep=round(sweep, DECIMALS) + 0.0)
        log = with_sweep_times(log, np.full(len(log), reading.sweep), reading.stamp)
        said.append(_said(told, sweep, how))
    delay = sweep_delay(log, motion, options.sweep)
    if delay:
        log, reading, late = _without_delay(log, reading, delay, options)
        said.append(late)
    return log, reading, said


def _times_beside(log: LaserLog, told: float, options: FileCheckOptions) -> tuple[float, ...]:
    """The times of a sweep to be tried where the file tells one, all in s.

    It may be for readings in the reverse order, or for a laser that sees at once. Or it may be wrong by a
    factor: a driver counts twice or half the readings, or takes the time from scan to scan for that of the
    readings in view. A laser that sweeps once a scan takes the time from scan to scan for a whole turn.
    """
    between, least = _time_between_scans(log, options), options.sweep.least_factor
    longer = (2.0 * abs(told), between) if between >= 2.0 * least * abs(told) else (between,)
    others = [float(np.copysign(each, told)) for each in (0.5 * told, *longer) if each]
    return 0.0, told, -told, *(each for each in others if max(each / told, told / each) >= least)


def _is_in_doubt(evidence: SweepEvidence, options: FileCheckOptions) -> bool:
    """Whether more beams and more pairs of scans may show a sweep that the file does not tell."""
    certainty = evidence.sigmas(evidence.sharpest, 0.0)
    return evidence.is_little or options.sweep.likelier_sigmas <= certainty < options.sweep.sigmas


def _sweep_by_scans(
    log: LaserLog, evidence: SweepEvidence, told: float, options: FileCheckOptions
) -> tuple[float, str]:
    """The time of a sweep by the scans, s, and how they show it; that which the file tells in doubt.

    Two times that differ by a factor are nearly as sharp if the true one is between them. So it is measured
    as soon as another one of the same sign is likelier than that of the file.
    """
    sharpest, limits = evidence.sharpest, options.sweep
    certainty = evidence.sigmas(sharpest, told)
    is_other_length = sharpest not in (0.0, -told)
    if sharpest == told or certainty < (
        limits.likelier_sigmas if told and is_other_length else limits.sigmas
    ):
        return told, ""
    compared = counted(len(evidence.energies), "pair")
    how = f"{compared} of scans match better that way, by {certainty:.1f} standard deviations"
    if not is_other_length and told:
        return sharpest, how
    longest = max(abs(told), _time_between_scans(log, options))
    steps = replace(options.steps, max_beams=limits.time.max_beams)
    found = sweep_time(ScanMotion.of_log(log, steps, limits), longest, evidence.options)
    if told:
        measured = (
            f"by {counted(found.pairs, 'pair')} of scans it is {found.seconds:.3g} ± {found.sigma:.2g} s"
        )
        return found.believed(told, longest, limits.sigmas), measured
    # There is one, and in doubt it lasts all of the time from scan to scan.
    whole = float(np.copysign(longest, sharpest))
    return found.believed(whole, longest, limits.sigmas) or whole, how


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


def _time_between_scans(log: LaserLog, options: FileCheckOptions) -> float:
    """The time from scan to scan, s, if a laser may turn for so long; else 0."""
    period = float(np.median(np.diff(log.times)))
    return period if options.sweep.shortest <= period <= options.sweep.longest else 0.0


def _said(told: float, sweep: float, how: str) -> str:
    flag, order = f"{sweep:.3g}", ", readings in the reverse order" if sweep < 0.0 else ""
    if sweep == 0.0:
        what, flag = "the laser sees all beams at once, though the file has times of beams", "off"
    elif told == 0.0:
        what = f"the laser turns for {abs(sweep):.3g} s{order}, though the file has no times of beams"
    elif sweep != -told:
        what = f"the laser turns for {abs(sweep):.3g} s{order}, not for {abs(told):.3g} s as the file says"
    else:
        what = "the readings are in the reverse order of time"
    return f"{what}: {how}; they are read that way, as with --sweep {flag}; --as-recorded believes the file"
