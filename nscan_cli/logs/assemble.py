"""The last step of every reader: raw scans and what was found about them become a LaserLog."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.limits import READINGS
from nscan_cli.files.source import Source
from nscan_cli.logs.beam_angles import beam_directions
from nscan_cli.logs.device_choice import Device
from nscan_cli.logs.frame_names import DEFAULT_FRAMES, FrameNames
from nscan_cli.logs.laser_defaults import mark_no_returns
from nscan_cli.logs.laser_log import LaserLog, LogReport, beam_counts
from nscan_cli.logs.lost_readings import lost_readings
from nscan_cli.logs.range_limits import limits_in_force
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.scan_order import ScanOrder, selected_numbers
from nscan_cli.logs.skips import Skips
from nscan_cli.poses import Array


@dataclass(frozen=True)
class RawScans:
    """The scans of one laser as the log has them, in file order: S scans of at most B beams."""

    ranges: NDArray[np.float32]
    """(S, B) m as written; nan beyond a scan's own beams."""
    angle_min: Array
    """(S,) rad"""
    angle_increment: Array
    """(S,) rad"""
    stamps: list[str]
    limits: tuple[float | Array, float | Array]
    """m, of all scans or (S,) of each; a reading at or beyond one of them says nothing, or that nothing was
    met."""
    limits_from: tuple[str, str] = ("none in this form of log", "assumed for this form of log")
    """Where each limit is from."""
    doubtful: Sequence[tuple[float, str]] = ()
    """Upper limits (m) that need not be the laser's own, and where each is from."""
    angle_max: Array | None = None
    """(S,) rad, the direction of the last beam as the log has it beside the step; nan where it has none."""
    beams: NDArray[np.int64] | None = None
    """(S,) how many beams each scan has; None: all have B."""

    def mirrored(self) -> RawScans:
        """The same with beams that run the other way round."""
        last = None if self.angle_max is None else -self.angle_max
        return replace(self, angle_min=-self.angle_min, angle_increment=-self.angle_increment, angle_max=last)


@dataclass
class Findings:
    """What a reader notes on its way, for the report."""

    skips: Skips
    records: dict[str, int] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    used: dict[str, str] = field(default_factory=dict)
    """Why this laser, odometry and mounting."""
    lasers: tuple[Device, ...] = ()
    laser_option: str = "--laser"
    odometries: tuple[Device, ...] = ()
    corrected: str = ""
    """As LogReport has them."""
    frames: FrameNames = DEFAULT_FRAMES


@dataclass(frozen=True)
class RecordedMotion:
    """What moves, in order of time: odometry (S, 3), true poses (T, 3) at truth_times (T,)."""

    odometry: Array | None
    truth_times: Array | None = None
    truth: Array | None = None


def empty_scan_table(scans: int, beams: int) -> NDArray[np.float32]:
    """The readings (S, B) of a log before they are filled in, nan. Raises LimitExceededError for too many."""
    problem = f"has {scans:,} scans of up to {beams:,} beams, {scans * beams:,} readings"
    READINGS.check(scans * beams, problem)
    return np.full((scans, beams), np.nan, dtype=np.float32)


def scan_table(readings: Sequence[NDArray[Any]]) -> NDArray[np.float32]:
    """Scans of different lengths as rows (S, B), nan beyond a scan's own beams. Raises LimitExceededError."""
    rows = empty_scan_table(len(readings), max(map(len, readings), default=0))
    with np.errstate(over="ignore", invalid="ignore"):
        for row, values in zip(rows, readings, strict=True):
            row[: len(values)] = values
    return rows


def laser_log(
    source: Source,
    form: str,
    laser: str,
    raw: RawScans,
    times: ScanOrder,
    mount: Array,
    motion: RecordedMotion,
    findings: Findings,
    options: ReadingOptions,
    file: str,
) -> LaserLog:
    """The log in order of time, cut to what was asked for, no-returns marked; `raw.ranges` is consumed.

    Raises WrongUsageError when the options leave no scan.
    """
    numbers = selected_numbers(times.times, options, file)
    rows = times.rows[numbers]
    warnings = findings.warnings
    limits = limits_in_force(raw, options, warnings)
    angle_min, angle_increment = beam_directions(raw, options, warnings)
    findings.used |= {"range_min": limits.low_from, "range_max": limits.high_from}
    ranges = raw.ranges if np.array_equal(rows, np.arange(len(raw.stamps))) else raw.ranges[rows]
    beams, limits = beam_counts(raw.ranges, raw.beams)[rows], limits.of(rows)
    lost = lost_readings(ranges, beams, limits, file)
    mark_no_returns(ranges, limits.low, limits.high)
    odometry = motion.odometry
    return LaserLog(
        source=source,
        format=form,
        laser=laser,
        numbers=numbers,
        stamps=tuple(times.stamps[number] for number in numbers),
        times=times.times[numbers],
        ranges=ranges,
        angle_min=angle_min[rows],
        angle_increment=angle_increment[rows],
        mount=mount,
        odometry=None if odometry is None else odometry[numbers],
        no_return=limits.no_return,
        range_limits=limits.whole,
        report=LogReport(
            records=findings.records,
            skipped=findings.skips.reasons,
            skipped_place=findings.skips.place,
            backward_stamps=times.backward,
            warnings=(*warnings, *lost.warnings),
            used=findings.used,
            lost=lost.counts,
            unusable=lost.unusable,
            lasers=findings.lasers,
            laser_option=findings.laser_option,
            odometries=findings.odometries,
            corrected=findings.corrected,
        ),
        beams=None if (beams == ranges.shape[1]).all() else beams,
        truth_times=motion.truth_times,
        truth=motion.truth,
        frames=findings.frames,
    )
