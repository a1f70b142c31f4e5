"""How a laser sits on its robot, from the transforms of a recording."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nscan_cli.errors import InputDataError
from tests.logs.forms import FORMS
from tests.logs.recordings.messages import MOUNT, START, S, Tf, Written, drive, turned, with_scans


def test_chains_of_transforms_in_several_messages(read):
    # base_link → plate (turned by 90°) → laser: 1 m ahead of the plate is 1 m to the robot's left.
    first = drive(mount=())
    chain = [
        Written(
            "/tf_static", START, (Tf(START, "base_link", "plate", (0.5, 0, 0.1), turned(yaw=math.pi / 2)),)
        ),
        Written("/tf_static", START, (Tf(START, "plate", "laser", (1.0, 0, 0), turned(yaw=-math.pi / 2)),)),
    ]
    log = read(chain + first)
    np.testing.assert_allclose(log.mount, (0.5, 1.0, 0.0), atol=1e-9)
    assert log.report.used["mounting"] == "tf base_link → plate → laser"


def test_transforms_against_their_direction_and_with_slashes(read):
    # ROS 1 names, and the tree hangs at the laser: the robot is 0.3 m behind it.
    back = Written("/tf_static", START, (Tf(START, "/laser", "/base_link", (-0.3, 0, 0)),))
    np.testing.assert_allclose(read([back, *drive(mount=())]).mount, (0.3, 0.0, 0.0), atol=1e-9)


def test_a_fixed_transform_that_is_sent_again_and_again(read):
    again = [
        Written("/tf", START + k * S // 10, (MOUNT._replace(stamp=START + k * S // 10),)) for k in range(10)
    ]
    log = read(sorted(drive(mount=()) + again, key=lambda one: one.log_time))
    np.testing.assert_allclose(log.mount, (0.2, 0.1, 0.3), atol=1e-9)


def test_an_unknown_mounting_is_said(read):
    log = read(drive(mount=()))
    np.testing.assert_array_equal(log.mount, (0, 0, 0))
    assert log.report.used["mounting"] == "assumed: at the robot's centre"
    assert "no transforms lead from base_link to laser" in log.report.warnings[0]
    assert read(drive(mount=()), mount=(1.0, 2.0, 0.5)).report.warnings == ()
    own = read(with_scans(frame="base_link"))
    assert own.report.used["mounting"] == "none: the scans are in the robot's frame, base_link"


@pytest.mark.parametrize(("roll", "pitch"), [(0.2, 0.0), (0.0, -0.3), (math.pi - 0.2, 0.0)])
def test_a_tilted_laser_is_refused(read, roll, pitch):
    tilted = drive(mount=[MOUNT._replace(quaternion=turned(0.3, roll, pitch))])
    degrees = {(0.2, 0.0): "11.5", (0.0, -0.3): "17.2", (math.pi - 0.2, 0.0): "11.5"}[roll, pitch]
    with pytest.raises(InputDataError, match=rf"tilted by {degrees}° \(tf base_link → laser\); give --mount"):
        read(tilted)
    np.testing.assert_array_equal(read(tilted, mount=(0.0, 0.0, 0.0)).mount, (0, 0, 0))


def test_half_a_degree_of_tilt_is_none(read):
    log = read(drive(mount=[MOUNT._replace(quaternion=turned(0.3, math.radians(0.5)))]))
    np.testing.assert_allclose(log.mount, (0.2, 0.1, 0.3), atol=1e-4)


@pytest.mark.parametrize("form", ["ros1", "ros2", "protobuf"])
def test_upside_down(form, read, tmp_path):
    # Turned by half a turn about the laser's x axis, then by yaw: beam angles change their sign.
    log = read(FORMS[form](drive(mount=[MOUNT._replace(quaternion=turned(0.3, math.pi))]), tmp_path))
    np.testing.assert_allclose(log.mount, (0.2, 0.1, 0.3), atol=1e-9)
    np.testing.assert_allclose(log.angle_min, 1.0)
    np.testing.assert_allclose(log.angle_increment, -0.5)
    assert log.report.used["mounting"].endswith("upside down")
    # In space: the first beam, 1 m long, seen from the robot.
    x, y = log.points(0)[0]
    assert (x, y) == pytest.approx((0.2 + math.cos(0.3 + 1.0), 0.1 + math.sin(0.3 + 1.0)), abs=1e-6)
