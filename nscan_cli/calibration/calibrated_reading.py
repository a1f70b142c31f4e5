"""The reading options that follow from a calibration: values that are certain and differ from the file."""

from __future__ import annotations

from dataclasses import replace

from nscan_cli.calibration.estimate import Estimate
from nscan_cli.calibration.options import CalibrationOptions
from nscan_cli.calibration.robot_calibration import Calibration
from nscan_cli.logs.beam_mask import mask_text
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions, sectors_from

DECIMALS = 4
"""Decimals of the lengths, angles, times and relative scales that are passed on: ten times finer than what a
drive tells."""


def calibrated_reading(
    calibration: Calibration, reading: ReadingOptions, options: CalibrationOptions
) -> ReadingOptions:
    """The options that read the log as calibrated; `reading` are those that it was read with.

    A value that the drive leaves open, or that agrees with the file, does not change.
    """
    values = calibration.values
    bounds = {
        "mount_x": options.max_place_sigma,
        "mount_y": options.max_place_sigma,
        "mount_angle": options.max_angle_sigma,
        "odometry_scale": options.max_scale_sigma * values["odometry_scale"].value,
        "clock_offset": options.max_clock_sigma,
    }
    told = {name: _is_told(values[name], bound, options.min_sigmas) for name, bound in bounds.items()}
    found = reading
    if calibration.mirrored:
        found = replace(found, flip=not reading.flip)
    if told["mount_x"] or told["mount_y"] or told["mount_angle"]:
        x, y, angle = (_passed_on(values[name], told[name]) for name in ("mount_x", "mount_y", "mount_angle"))
        found = replace(found, mount=(x, y, angle))
    if told["odometry_scale"]:
        scale = values["odometry_scale"].value
        found = replace(found, odometry_scale=float(f"{scale:.{DECIMALS}g}"))
    if calibration.sweep != values["sweep_time"].recorded:
        found = replace(found, sweep=round(calibration.sweep, DECIMALS) + 0.0)
    if calibration.stamp not in (None, reading.stamp):
        return replace(found, stamp=calibration.stamp)
    clock = values["clock_offset"]
    # Beams of a laser that turns are corrected by odometry, which has to be that of their time.
    least = options.sweep.least_delay if calibration.sweep else options.clock.min_offset
    if told["clock_offset"] and abs(clock.value - reading.clock_offset) >= least:
        found = replace(found, clock_offset=round(clock.value, DECIMALS))
    return found


def as_put_right(log: LaserLog, reading: ReadingOptions) -> ReadingOptions:
    """The options that say what reading a log has put right of its laser: unit and offset of the ranges, and
    beams that see the robot. `reading` are those that it was read with."""
    used, masked = log.report.used, log.report.masked
    found = reading
    if reading.range_scale is None and "range_scale" in used:
        found = replace(found, range_scale=float(used["range_scale"]))
    if reading.range_offset is None and "range_offset" in used:
        found = replace(found, range_offset=float(used["range_offset"]))
    if reading.mask is None and masked:
        found = replace(found, mask=sectors_from(mask_text(masked)))
    return found


def _is_told(estimate: Estimate, bound: float, sigmas: float) -> bool:
    """Whether a value is known well enough, and not that of the file."""
    assert estimate.recorded is not None
    off = abs(estimate.value - estimate.recorded)
    return estimate.sigma <= bound and off > sigmas * estimate.sigma


def _passed_on(estimate: Estimate, is_told: bool) -> float:
    assert estimate.recorded is not None
    return round(estimate.value, DECIMALS) if is_told else estimate.recorded
