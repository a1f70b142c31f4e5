"""The last step of every reader: raw scans and what was found about them become a LaserLog."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nscan_cli.limits import READINGS
from nscan_cli.logs.choices import Device
from nscan_cli.logs.frame_names import AS_USUAL, FrameNames
from nscan_cli.logs.laser import mark_no_returns, no_return_value
from nscan_cli.logs.options import ReadingOptions
from nscan_cli.logs.order import Order, selection
from nscan_cli.logs.scan import LaserLog, LogReport, Source
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
    limits: tuple[float, float]
    """m; a reading at or beyond one of them says nothing, or that nothing was met."""


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
    frames: FrameNames = AS_USUAL


@dataclass(frozen=True)
class Motion:
    """What moves, in order of time: odometry (S, 3), true poses (T, 3) at truth_times (T,)."""

    odometry: Array | None
    truth_times: Array | None = None
    truth: Array | None = None


def empty_table(scans: int, beams: int) -> NDArray[np.float32]:
    """The readings (S, B) of a log before they are filled in, nan. Raises ExceededError for too many."""
    problem = f"has {scans:,} scans of up to {beams:,} beams, {scans * beams:,} readings"
    READINGS.check(scans * beams, problem)
    return np.full((scans, beams), np.nan, dtype=np.float32)


def stacked(readings: Sequence[NDArray[Any]]) -> NDArray[np.float32]:
    """Scans of different lengths as rows (S, B), nan beyond a scan's own beams. Raises ExceededError."""
    rows = empty_table(len(readings), max(map(len, readings), default=0))
    with np.errstate(over="ignore", invalid="ignore"):
        for row, values in zip(rows, readings, strict=True):
            row[: len(values)] = values
    return rows


def laser_log(
    source: Source,
    form: str,
    laser: str,
    raw: RawScans,
    times: Order,
    mount: Array,
    motion: Motion,
    findings: Findings,
    options: ReadingOptions,
    file: str,
) -> LaserLog:
    """The log in order of time, cut to what was asked for, no-returns marked; `raw.ranges` is consumed.

    Raises WrongUsageError when the options leave no scan.
    """
    numbers = selection(times.times, options, file)
    rows = times.rows[numbers]
    no_return, limits = _limits(raw, options)
    ranges = raw.ranges if np.array_equal(rows, np.arange(len(raw.stamps))) else raw.ranges[rows]
    mark_no_returns(ranges, limits)
    angle_min, angle_increment = _angles(raw, options)
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
        no_return=no_return,
        range_limits=limits,
        report=LogReport(
            records=findings.records,
            skipped=findings.skips.reasons,
            skipped_place=findings.skips.place,
            backward_stamps=times.backward,
            warnings=tuple(findings.warnings),
            used=findings.used,
            lasers=findings.lasers,
            laser_option=findings.laser_option,
            odometries=findings.odometries,
            corrected=findings.corrected,
        ),
        truth_times=motion.truth_times,
        truth=motion.truth,
        frames=findings.frames,
    )


def _angles(raw: RawScans, options: ReadingOptions) -> tuple[Array, Array]:
    """First direction and step (S,) of each scan, rad, as the user says, else as the log does."""
    size = len(raw.stamps)
    first, step = raw.angle_min, raw.angle_increment
    if options.angle_increment is not None:
        step = np.full(size, options.angle_increment)
    if options.angle_min is not None:
        first = np.full(size, options.angle_min)
    return (-first, -step) if options.flip else (first, step)


def _limits(raw: RawScans, options: ReadingOptions) -> tuple[float | None, tuple[float, float]]:
    """The no-return value found, and the range limits in force (m)."""
    low, high = raw.limits
    no_return = no_return_value(raw.ranges)
    if options.max_range is not None:
        high = options.max_range
    if no_return is not None:
        high = min(high, no_return)
    return no_return, (low if options.min_range is None else options.min_range, high)
