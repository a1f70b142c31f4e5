"""Odometry, true poses and mounting in CARMEN logs; what is expected is derived beside each."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nscan_cli.logs.reading_options import ReadingOptions
from tests.logs.lines import flaser, read


def test_rawlaser_takes_odometry_from_odom(tmp_path):
    # Half way in time between the two ODOM records, across ±180°: 179° and −177° meet at −179°.
    a, b = math.radians(179), math.radians(-177)
    log = read(
        tmp_path,
        f"ODOM 0 0 {a} 0 0 0 10.0 h 0",
        f"ODOM 2 4 {b} 0 0 0 12.0 h 0",
        "RAWLASER1 0 -1.5 3.0 0.5 20 0 0 2 1 2 0 11.0 h 0",
        "RAWLASER1 0 -1.5 3.0 0.5 20 0 0 2 1 2 0 11.5 h 0",
    )
    assert log.odometry is not None
    np.testing.assert_allclose(log.odometry[0], (1, 2, math.radians(-179)))
    np.testing.assert_allclose(log.odometry[1], (1.5, 3, math.radians(-178)))


def test_rawlaser_without_odom_has_no_odometry(tmp_path):
    log = read(tmp_path, "RAWLASER1 0 -1.5 3.0 0.5 20 0 0 2 1 2 0 11.0 h 0")
    assert log.odometry is None
    assert "no odometry" in log.report.warnings[0]


def test_odom_without_times_is_no_odometry(tmp_path):
    scans = [f"RAWLASER1 0 -1.5 0.5 0.5 20 0 0 2 1 2 0 {time}.0 h 0" for time in (1, 2)]
    log = read(tmp_path, *scans, *["ODOM 1 2 0 0 0 0 0 h 0"] * 3, *["TRUEPOS 1 2 0 0 0 0 0 h 0"] * 3)
    assert log.odometry is None
    assert log.truth is None
    assert len(log.report.warnings) == 2


def test_laser3_has_no_angles_and_no_mount(tmp_path):
    log = read(tmp_path, "LASER3 3 1 2 3 1.0 h 0", "ODOM 1 2 0 0 0 0 1.0 h 0")
    assert log.laser == "LASER3"
    assert math.degrees(log.angle_increment[0]) == pytest.approx(90)
    assert any("LASER3" in warning for warning in log.report.warnings)


def test_all_poses_zero_is_no_odometry(tmp_path):
    log = read(tmp_path, flaser(1), flaser(2), flaser(3))
    assert log.odometry is None


def test_truepos(tmp_path):
    log = read(
        tmp_path,
        flaser(1),
        "TRUEPOS 5 6 0.5 0 0 0 2.0 h 0",
        "TRUEPOS 4 5 0.25 0 0 0 1.0 h 0",
        "TRUEPOS 4 5 0.25 0 0 0",
    )
    assert log.truth is not None
    assert log.truth_times is not None
    np.testing.assert_array_equal(log.truth, [[4, 5, 0.25], [5, 6, 0.5]])
    np.testing.assert_array_equal(log.truth_times, [1, 2])
    assert log.report.skipped == {"wrong number of values": (1, 4)}


def test_odometry_can_be_left_out(tmp_path):
    assert read(tmp_path, flaser(1), options=ReadingOptions(odometry=False)).odometry is None


PARAMS = ("PARAM robot_frontlaser_offset 0.2 nohost 0", "PARAM robot_frontlaser_side_offset -0.1 nohost 0")


def test_param_mounts_the_laser_when_both_poses_are_equal(tmp_path):
    log = read(tmp_path, *PARAMS, flaser(1, laser=(1, 1, 1)))
    np.testing.assert_allclose(log.mount, (0.2, -0.1, 0))
    assert "PARAM" in log.report.warnings[0]


@pytest.mark.parametrize(("ahead", "warned"), [(0.2, False), (0.205, False), (0.3, True)])
def test_poses_win_over_param(tmp_path, ahead, warned):
    # Within 1 cm both say the same.
    log = read(tmp_path, *PARAMS, flaser(1, laser=(1 + ahead, 0.9, 0), robot=(1, 1, 0)))
    np.testing.assert_allclose(log.mount, (ahead, -0.1, 0), atol=1e-6)
    assert any("PARAM" in warning for warning in log.report.warnings) == warned


def test_the_rear_laser_is_turned_unless_param_says(tmp_path):
    rear = [flaser(1, laser=(1, 1, 1), tag="RLASER"), flaser(2, laser=(2, 1, 1), tag="RLASER")]
    offset = "PARAM robot_rearlaser_offset -0.3 nohost 0"
    np.testing.assert_allclose(read(tmp_path, *rear).mount, (0, 0, math.pi))
    np.testing.assert_allclose(read(tmp_path, offset, *rear).mount, (-0.3, 0, math.pi))
    angle = "PARAM robot_rearlaser_angular_offset 3.0 nohost 0"
    np.testing.assert_allclose(read(tmp_path, offset, angle, *rear).mount, (-0.3, 0, 3.0))
