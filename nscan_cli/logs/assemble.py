"""The last step of every reader: a LaserLog from the raw scans and what the reader found."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.provenance import Source
from nscan_cli.logs.angle_unit import with_radians
from nscan_cli.logs.beam_angles import beam_directions
from nscan_cli.logs.beam_mask import mask_beams, masked_sectors
from nscan_cli.logs.beam_spacing import checked_by_walls
from nscan_cli.logs.blind_scans import blind_scans
from nscan_cli.logs.device_choice import Device
from nscan_cli.logs.direction_changes import corrected_directions
from nscan_cli.logs.floor_line import floor_line, without_floor
from nscan_cli.logs.frame_names import DEFAULT_FRAMES, FrameNames
from nscan_cli.logs.jittery_odometry import without_jitter
from nscan_cli.logs.laser_defaults import mark_no_returns
from nscan_cli.logs.laser_log import LaserLog, LogReport, beam_counts
from nscan_cli.logs.odometry_outliers import without_outliers
from nscan_cli.logs.range_limits import RangeLimits, limits_in_force
from nscan_cli.logs.range_noise import noise_of_ranges
from nscan_cli.logs.range_offset import checked_offset
from nscan_cli.logs.range_unit import WrongUnit, scaled, wrong_unit
from nscan_cli.logs.raw_scans import RawScans
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.repeated_reading import without_repeated_readings
from nscan_cli.logs.robot_parts import ScanTable
from nscan_cli.logs.robot_path import RobotPath, poses_at, robot_path
from nscan_cli.logs.rolled_readings import with_first_beam_first
from nscan_cli.logs.rounded_ranges import rounding_of_ranges
from nscan_cli.logs.scan_order import ScanOrder, selected_numbers
from nscan_cli.logs.skips import Skips
from nscan_cli.logs.slow_odometry import without_repeats
from nscan_cli.logs.sweep import Sweep, beam_times, sweep_of_file
from nscan_cli.logs.two_odometries import of_one_source
from nscan_cli.logs.unit_by_odometry import UnitByOdometry, unit_by_odometry
from nscan_cli.logs.unit_stretches import in_one_unit
from nscan_cli.logs.unusable_readings import unusable_readings
from nscan_cli.logs.whole_revolution import in_whole_revolutions
from nscan_cli.poses import Array, Indices, are_known


@dataclass
class ReaderFindings:
    """What a reader collects for the report."""

    skips: Skips
    options: ReadingOptions
    """Those that it reads with."""
    records: dict[str, int] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    used: dict[str, str] = field(default_factory=dict)
    """The reasons for laser, odometry and mounting, as in LogReport."""
    lasers: tuple[Device, ...] = ()
    laser_option: str = "--laser"
    odometries: tuple[Device, ...] = ()
    corrected: str = ""
    frames: FrameNames = DEFAULT_FRAMES
    contradictions: list[str] = field(default_factory=list)
    """What the scans contradict, as in LogReport."""


@dataclass(frozen=True)
class RecordedMotion:
    """Poses in order of time: odometry (S, 3), and true poses (T, 3) at truth_times (T,)."""

    odometry: Array | None
    truth_times: Array | None = None
    truth: Array | None = None
    path: RobotPath | None = None
    """Odometry at its own times; None if it has those of the scans."""


def scaled_odometry(odometry: Array, scale: float) -> Array:
    """Odometry (S, 3) with its positions multiplied."""
    return odometry * (scale, scale, 1.0)


def laser_log(
    source: Source,
    form: str,
    laser: str,
    raw: RawScans,
    times: ScanOrder,
    mount: Array,
    motion: RecordedMotion,
    findings: ReaderFindings,
) -> LaserLog:
    """The selected scans in order of time, with no-returns marked. `raw.ranges` may be overwritten.

    Raises WrongUsageError if the options select no scan.
    """
    file, options = findings.skips.file, findings.options
    numbers = selected_numbers(times.times, options, file)
    rows = times.rows[numbers]
    warnings, of_file = findings.warnings, len(findings.warnings)
    raw, limits, contradictions = _in_metres(raw, times, motion.odometry, mount, findings)
    repeated = np.zeros(len(raw.ranges), dtype=np.int64)
    if not options.as_recorded:
        raw, converted = with_radians(raw)
        contradictions += converted
    # With --max-range the user asks for all readings up to it.
    if not options.as_recorded and options.max_range is None:
        repeated, no_distances = without_repeated_readings(raw.ranges, limits)
        contradictions += no_distances
    written = beam_directions(raw, options, warnings)
    beams, changed = beam_counts(raw.ranges, raw.beams), list[str]()
    if not options.as_recorded:
        seen = ScanTable(raw.ranges, limits, *written, times.rows, times.times)
        written, changed = corrected_directions(seen, beams, -1 if options.flip else 1)
        raw, rolled = with_first_beam_first(raw, written, limits)
        changed += rolled
    directions, told = in_whole_revolutions(raw, written, limits, options)
    if not told:
        directions, told = checked_by_walls(raw, written, limits, options)
    angle_min, angle_increment = directions
    contradictions += [*changed, *told]
    findings.used |= {"range_min": limits.low_from, "range_max": limits.high_from}
    table = ScanTable(raw.ranges, limits, angle_min, angle_increment, times.rows, times.times)
    sectors, masked = masked_sectors(table, options)
    floor = None if options.as_recorded else floor_line(table, sectors)
    ranges = raw.ranges if np.array_equal(rows, np.arange(len(raw.stamps))) else raw.ranges[rows]
    beams, limits = beams[rows], limits.of(rows)
    lost = unusable_readings(ranges, beams, limits, file)
    of_one_value = int(repeated[rows].sum())
    if of_one_value:
        # They were usable, and are counted as no number now.
        others = lost.counts.pop("not a number") - of_one_value
        if others:
            lost.counts["not a number"] = others
        lost.counts["of one value"] = of_one_value
    mark_no_returns(ranges, limits.low, limits.high)
    inexact = rounding_of_ranges(ranges), noise_of_ranges(ranges, angle_increment[rows])
    warnings += [text for text in inexact if text]
    warnings += blind_scans(ranges, numbers)
    hidden = mask_beams(ranges, angle_min[rows], angle_increment[rows], sectors)
    if hidden:
        lost.counts["in masked sectors"] = hidden
    if floor is not None:
        lost.counts["of the floor"] = without_floor(ranges, angle_min[rows], angle_increment[rows], floor)
        masked.append(floor.said)
    offset, of_offset = 0.0, list[str]()
    # An angle between beams that is wrong, and stays so, bends walls, too.
    if options.range_offset is not None or not told or angle_increment is not written.step:
        offset, of_offset = checked_offset(ranges, angle_increment[rows], options)
    contradictions += of_offset
    if offset:
        ranges += np.float32(offset)
        ranges[ranges <= 0.0] = np.nan
        findings.used["range_offset"] = f"{offset:g}"
    sweep = _sweep(raw, angle_increment, times, options)
    if sweep.origin:
        findings.used["turn"] = sweep.origin
    swept = beam_times(sweep.seconds[numbers], angle_increment[rows], beams, options.stamp)
    odometry, path, slow = _odometry(motion, times, raw.ranges, options)
    # Of several lasers, each says its own.
    of = f"{laser}: " if len(findings.lasers) > 1 else ""
    of_laser = [f"{of}{said}" for said in (*warnings[of_file:], *lost.warnings)]
    if odometry is not None:
        odometry = odometry[numbers]
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
        odometry=odometry if odometry is not None and are_known(odometry).any() else None,
        no_return=limits.no_return,
        range_limits=limits.whole,
        report=LogReport(
            records=findings.records,
            skipped=findings.skips.reasons,
            skipped_place=findings.skips.place,
            backward_stamps=times.backward,
            warnings=(*warnings[:of_file], *of_laser),
            used=findings.used,
            lost=lost.counts,
            unusable=lost.unusable,
            lasers=findings.lasers,
            laser_option=findings.laser_option,
            odometries=findings.odometries,
            corrected=findings.corrected,
            masked=tuple(sectors),
            contradictions=(
                *findings.contradictions,
                *(f"{of}{said}" for said in (*contradictions, *masked)),
                *slow,
                *(f"{of}{said}" for said in sweep.said),
            ),
        ),
        beams=None if (beams == ranges.shape[1]).all() else beams,
        truth_times=motion.truth_times,
        truth=motion.truth,
        frames=findings.frames,
        reading=options,
        beam_times=swept,
        odometry_path=path,
    )


def _odometry(
    motion: RecordedMotion, times: ScanOrder, ranges: NDArray[np.float32], options: ReadingOptions
) -> tuple[Array | None, RobotPath | None, list[str]]:
    """The odometry (S, 3) of all scans in order of time, its path, and what was put right.

    ranges (S, B) are in file order.
    """
    odometry, recorded = motion.odometry, motion.path
    if odometry is None:
        return None, recorded, []
    scale = options.odometry_scale
    if recorded is None:
        odometry, said = _credible(odometry, times.times, (ranges, times.rows), options, times.is_measured)
        return scaled_odometry(odometry, scale), None, said
    poses, said = _credible(recorded.poses, recorded.times, None, options)
    path = robot_path(recorded.times, scaled_odometry(poses, scale))
    odometry = scaled_odometry(odometry, scale)
    if said and path is not None:
        # Nothing is interpolated where poses are not used.
        is_told = are_known(odometry) & (np.interp(times.times, recorded.times, are_known(poses)) == 1.0)
        odometry = np.where(is_told[:, None], poses_at(path, times.times), np.nan)
    return odometry, path, said


def _credible(
    odometry: Array,
    times: Array,
    scans: tuple[NDArray[np.float32], Indices] | None,
    options: ReadingOptions,
    is_measured: bool = True,
) -> tuple[Array, list[str]]:
    """Odometry (S, 3) at times (S,), s, of one source, without outliers and repeats; and messages.

    `scans` are as `without_repeats` takes them, `is_measured` as `without_outliers` takes it.
    """
    if options.as_recorded:
        return odometry, []
    odometry, both = of_one_source(odometry, times)
    odometry, noise = without_jitter(odometry, times)
    odometry, wrong = without_outliers(odometry, times, is_measured=is_measured)
    odometry, slow = without_repeats(odometry, times, scans)
    return odometry, [text for text in (both, noise, wrong, slow) if text]


def _sweep(raw: RawScans, increments: Array, times: ScanOrder, options: ReadingOptions) -> Sweep:
    """The times of the laser's sweeps (S,), in order of time; `increments` (S,) are in file order, rad."""
    if options.sweep is not None:
        return Sweep(np.full(len(times.times), options.sweep), "--sweep")
    rows, beams = times.rows, beam_counts(raw.ranges, raw.beams)
    told = None if raw.recorded_sweep is None else raw.recorded_sweep.of(rows)
    return sweep_of_file(told, increments[rows], beams[rows], times.times, options.as_recorded)


def _in_metres(
    raw: RawScans, times: ScanOrder, odometry: Array | None, mount: Array, findings: ReaderFindings
) -> tuple[RawScans, RangeLimits, list[str]]:
    """The scans in metres, their limits, and messages if the scans contradict the unit of the log.

    odometry (S, 3) is in order of time, and the laser is at `mount` (3,) on the robot.
    """
    options = findings.options
    if options.range_scale is not None:
        raw = scaled(raw, options.range_scale)
        return raw, limits_in_force(raw, options, findings.warnings), []
    raw, mixed = (raw, []) if options.as_recorded else in_one_unit(raw, times)
    said: list[str] = []
    limits = limits_in_force(raw, options, said)
    unit = None if options.as_recorded else _unit(raw, times, odometry, mount, limits)
    if unit is None:
        findings.warnings += said
        return raw, limits, mixed
    raw, findings.used["range_scale"] = scaled(raw, unit.scale), f"{unit.scale:g}"
    limits = limits_in_force(raw, options, findings.warnings)
    return raw, limits, [*mixed, unit.correction]


def _unit(
    raw: RawScans, times: ScanOrder, odometry: Array | None, mount: Array, limits: RangeLimits
) -> WrongUnit | UnitByOdometry | None:
    """The unit of the readings, if it is beyond doubt and not metres. Where odometry tells another one than
    their size, that is the unit."""
    by_odometry = unit_by_odometry(raw, times, odometry, mount, limits.no_return)
    by_size = wrong_unit(raw.ranges, limits)
    is_certain = by_size is not None and by_size.is_certain
    if by_odometry is None or (by_size is not None and is_certain and by_size.scale == by_odometry.scale):
        return by_size if is_certain else None
    return by_odometry
