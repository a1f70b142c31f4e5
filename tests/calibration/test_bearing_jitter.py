"""First directions that jitter in the file alone are replaced by one; those of the laser are kept."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.bearing_jitter import checked_bearings
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from tests.data import data_file
from tests.simulation import faults
from tests.slam.keyframe_drives import round_scene

OPTIONS = FileCheckOptions()


@functools.cache
def drive() -> LaserLog:
    return round_scene().record(5).log()


@pytest.mark.parametrize("degrees", [1.0, 3.0])
def test_jitter_in_the_file_is_put_right(degrees):
    log = drive()
    right, said = checked_bearings(faults.first_directions_jitter(log, np.radians(degrees)), OPTIONS)
    assert len(said) == 1
    assert "the laser looks the same way" in said[0]
    np.testing.assert_allclose(right.angle_min, log.angle_min, atol=np.radians(0.3 * degrees))
    assert np.ptp(right.angle_min) == 0.0


def test_a_laser_that_begins_elsewhere_each_time_is_believed():
    """Its readings are shifted by as much."""
    log = drive()
    shifts = np.random.default_rng(1).integers(-4, 5, len(log))
    ranges = np.array([np.roll(scan, -shift) for scan, shift in zip(log.ranges, shifts, strict=True)])
    shifted = replace(log, ranges=ranges, angle_min=log.angle_min + shifts * log.angle_increment)
    assert checked_bearings(shifted, OPTIONS) == (shifted, [])
    assert checked_bearings(log, OPTIONS) == (log, [])


def test_without_odometry_nothing_tells():
    jittering = faults.first_directions_jitter(replace(drive(), odometry=None), 0.05)
    assert checked_bearings(jittering, OPTIONS) == (jittering, [])


def test_it_is_found_in_a_real_log():
    log = read_log(str(data_file("mit-csail.log.gz")))
    _, said = checked_bearings(faults.first_directions_jitter(log, np.radians(3.0)), OPTIONS)
    assert len(said) == 1
