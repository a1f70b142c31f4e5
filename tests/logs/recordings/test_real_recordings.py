"""Real recordings: a log as CARMEN and as MCAP is the same, and a robot's own recording needs no word."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.errors import InputDataError
from nscan_cli.logs.load import read_log
from tests.data import data_file

pytestmark = pytest.mark.logs


def test_mit_csail_as_carmen_and_as_mcap():
    text = read_log(str(data_file("mit-csail.log.gz")))
    recording = read_log(str(data_file("mit-csail.ros2.mcap")))
    # The MCAP has ranges, angles and limits as float32, stamps in ns and headings as quaternions.
    np.testing.assert_array_equal(recording.ranges, text.ranges)
    np.testing.assert_allclose(recording.times, text.times, atol=5e-7)
    assert recording.odometry is not None
    assert text.odometry is not None
    np.testing.assert_allclose(recording.odometry, text.odometry, atol=1e-9)
    np.testing.assert_allclose(recording.angle_min, text.angle_min, atol=1e-7)
    np.testing.assert_allclose(recording.angle_increment * 360, text.angle_increment * 360, atol=1e-7)
    np.testing.assert_array_equal(recording.mount, text.mount)
    assert recording.no_return == text.no_return
    assert recording.report.warnings == ()


def test_walker_needs_nothing_but_its_path():
    log = read_log(str(data_file("walker.mcap")))
    assert log.ranges.shape == (92, 360)
    assert log.times[-1] - log.times[0] == pytest.approx(18.2)
    # The TurtleBot3 has its lidar 64 mm behind the wheels' axle.
    np.testing.assert_allclose(log.mount, (-0.064, 0, 0), atol=1e-9)
    assert log.report.used["mounting"] == "tf base_footprint → base_link → base_scan"
    assert log.odometry is not None
    assert np.isfinite(log.odometry).all()
    assert log.report.warnings == ()
    assert log.report.skipped == {}
    finite = log.ranges[np.isfinite(log.ranges)]
    assert 0.12 <= finite.min() <= finite.max() <= 3.5


def test_a_laser_that_nods_is_refused_by_name():
    with pytest.raises(InputDataError, match=r"nods, from 40\.1° down to .*: tilt_base → tilt_axis moves"):
        read_log(str(data_file("field/tilting.bag")))


def test_a_robot_that_rocks():
    log = read_log(str(data_file("strangers/moving-tf.mcap")))
    # base_link rocks by ±2° under a laser 0.3 m ahead that looks back.
    np.testing.assert_allclose(log.mount[:2], (0.3, 0.0), atol=2e-3)
    assert abs(log.mount[2]) == pytest.approx(np.pi, abs=1e-3)
