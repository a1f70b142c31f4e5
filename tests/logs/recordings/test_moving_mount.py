"""Lasers on transforms that move: of those that rock the mean is taken, those that nod or pan are refused."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from nscan_cli.errors import InputDataError
from tests.logs.forms import FORMS
from tests.logs.recordings.messages import PERIOD, START, Odom, Scan, Tf, Written, drive, turned

Pose = tuple[tuple[float, float, float], tuple[float, float, float, float]]
COUNT = 60
"""Poses of a moving transform, as many as two a period of drive(30)."""
LASER = Tf(START, "base_link", "laser", (0.3, 0.1, 0.2), turned(yaw=math.pi / 2))
HANGING = Tf(START, "base_link", "laser", (0.3, 0.1, 0.2), turned(math.pi / 2, math.pi))


def wave(k: int, degrees: float) -> float:
    """An angle (rad) that swings to both sides, three times in COUNT."""
    return math.radians(degrees) * math.sin(2 * math.pi * 3 * k / COUNT)


def rocking(degrees: float, rise: float = 0.0) -> Callable[[int], Pose]:
    """A link that rolls and pitches by so much to either side, and rises by some metres."""
    return lambda k: (
        (0.0, 0.0, 0.1 + rise * k / COUNT),
        turned(roll=wave(k, degrees), pitch=wave(k + 5, degrees)),
    )


def on_moving(
    link: Callable[[int], Pose],
    parent: str = "base_footprint",
    child: str = "base_link",
    fixed: Tf | None = LASER,
    static: str = "/tf_static",
    robot: str | None = "base_footprint",
) -> list[Written]:
    """A drive with /odom of `robot` (None: no odometry); a link moves, and `fixed` comes beside it."""
    written = drive(COUNT // 2, mount=(), odom_topic=None if robot is None else "/odom")
    written = [
        Written(one.topic, one.log_time, one.content._replace(child=robot or ""))
        if isinstance(one.content, Odom)
        else one
        for one in written
    ]
    for k in range(COUNT):
        at = START + k * PERIOD // 2
        written.append(Written("/tf", at, (Tf(at, parent, child, *link(k)),)))
        if fixed is not None and (static == "/tf" or k == 0):
            written.append(Written(static, at, (fixed._replace(stamp=at),)))
    return sorted(written, key=lambda one: one.log_time)


@pytest.mark.parametrize("form", ["ros1", "ros2", "protobuf", "json", "ROS 1 bag", "ROS 2 db3"])
@pytest.mark.parametrize("static", ["/tf_static", "/tf"])
def test_a_robot_that_rocks(form, static, read, tmp_path):
    log = read(FORMS[form](on_moving(rocking(2.0, 0.03), static=static), tmp_path))
    # Tilted by 2° and 0.2 m above the axis, the laser sways by 7 mm; over whole swings, by less than 1 mm.
    np.testing.assert_allclose(log.mount, (0.3, 0.1, math.pi / 2), atol=1e-3)
    # Roll and pitch are a quarter of a swing apart, so that together they are never more than either.
    assert log.report.used["mounting"].startswith(
        "tf base_footprint → base_link → laser; base_footprint → base_link moves, so that it tilts by up to "
        "2.0° and rises by 0.0"
    )
    assert log.report.used["mounting"].endswith(": the mean is used")
    assert log.report.warnings == ()
    assert log.frames.robot == "base_footprint"


def test_a_robot_that_rises_only(read):
    log = read(on_moving(rocking(0.0, 0.2)))
    np.testing.assert_allclose(log.mount, (0.3, 0.1, math.pi / 2), atol=1e-9)
    assert "tilts by up to 0.0° and rises by 0.19" in log.report.used["mounting"]


def test_a_laser_upside_down_that_rocks(read):
    log = read(on_moving(rocking(2.0), fixed=HANGING))
    np.testing.assert_allclose(log.mount, (0.3, 0.1, math.pi / 2), atol=1e-3)
    # As of a laser that hangs on a fixed transform, the beams run the other way round.
    np.testing.assert_allclose(log.angle_min, 1.0)
    assert log.report.used["mounting"].endswith("upside down")


def test_the_link_below_the_laser_may_rock_too(read):
    """The same with the moving link at the other end of the chain, and written the other way round."""
    fixed = Tf(START, "chassis", "mast", (0.2, 0.0, 0.5), turned(yaw=0.3))
    log = read(on_moving(rocking(2.0), "laser", "mast", fixed, robot="chassis"))
    assert log.report.used["mounting"].startswith("tf chassis → mast → laser; laser → mast moves")
    # The mast is 0.1 m above the laser, which is at the mast's place seen from above.
    np.testing.assert_allclose(log.mount, (0.2, 0.0, 0.3), atol=1e-3)


def test_without_odometry_the_robot_has_the_frame_that_odometry_names(read):
    written = on_moving(rocking(1.0), "chassis", "mast", LASER._replace(parent="mast"), robot="chassis")
    log = read(written, odometry=False)
    assert log.odometry is None
    assert log.report.used["mounting"].startswith("tf chassis → mast → laser")
    bare = read(on_moving(rocking(1.0), robot=None))
    assert bare.report.used["mounting"].startswith("tf base_link → laser")


@pytest.mark.parametrize("robot", ["base_footprint", None])
@pytest.mark.parametrize("degrees", [6.0, 30.0])
def test_a_laser_that_nods_is_refused(read, degrees, robot):
    nodding = on_moving(
        lambda k: ((0.1, 0.0, 0.3), turned(pitch=wave(k, degrees))),
        child="laser", fixed=None, robot=robot,
    )  # fmt: skip
    said = (
        rf"laser nods, from {degrees}° down to {degrees}° up: base_footprint → laser moves .*; give --mount"
    )
    with pytest.raises(InputDataError, match=said):
        read(nodding)
    np.testing.assert_array_equal(read(nodding, mount=(0.0, 0.0, 0.0)).mount, (0, 0, 0))


@pytest.mark.parametrize(
    ("link", "said"),
    [
        # Positive pitch looks down (REP 103), and half a turn round the zenith is no new start.
        (lambda k: ((0, 0, 0), turned(pitch=0.7 - 0.06 * k)), "nods, from 40.1° down to 162.7° up"),
        (lambda k: ((0, 0, 0), turned(roll=wave(k, 20))), "rolls, from -20.0° to 20.0°"),
        (lambda k: ((0, 0, 0), turned(yaw=wave(k, 90))), "pans, from -90.0° to 90.0°"),
        (lambda k: ((0, 0, 0), turned(yaw=k)), "pans round and round"),
        (lambda k: ((0, 0, 0), turned(pitch=0.3 * k)), "nods round and round"),
        (lambda k: ((0.01 * k, 0, 0), turned()), "slides, by up to 0.29 m to either side"),
    ],
)  # fmt: skip
def test_how_a_laser_moves(read, link, said):
    with pytest.raises(
        InputDataError, match=rf"its laser {said}.*: base_footprint → base_link moves \(tf base"
    ):
        read(on_moving(link, fixed=LASER._replace(quaternion=turned())))


def test_a_laser_that_nods_on_no_robot_is_refused_too(read):
    """As a scanner on a tripod records it: nothing is known as a robot's frame."""
    nodding = on_moving(
        lambda k: ((0, 0, 0), turned(pitch=wave(k, 40))),
        "tripod", "axis", Tf(START, "axis", "laser", (0, 0, 0.1)), robot=None,
    )  # fmt: skip
    with pytest.raises(
        InputDataError, match=r"laser nods, .*: tripod → axis moves \(tf tripod → axis → laser\)"
    ):
        read(nodding)


@pytest.mark.parametrize("world", ["odom_combined", "map", "world"])
def test_what_moves_in_the_world_is_the_robot(read, world):
    """A device in the hand: tf has it tilted in the room, and nothing between it and its laser moves."""
    handheld = on_moving(
        lambda k: ((0.1 * k, 0, 0), turned(yaw=wave(k, 60), pitch=wave(k, 10))),
        world, "device", Tf(START, "device", "laser", (0, 0, 0.1)), robot=None,
    )  # fmt: skip
    log = read(handheld)
    np.testing.assert_array_equal(log.mount, (0, 0, 0))
    assert (log.odometry is None) == (world != "odom_combined")


def test_other_parts_that_move_do_not_matter(read):
    wheels = on_moving(
        lambda k: ((0, 0.2, 0), turned(pitch=0.5 * k)), "base_link", "wheel", LASER, robot="base_link"
    )
    log = read(wheels)
    np.testing.assert_allclose(log.mount, (0.3, 0.1, math.pi / 2), atol=1e-9)
    assert log.report.used["mounting"] == "tf base_link → laser"


def test_a_base_that_tf_has_by_its_other_name(read):
    """Odometry places base_footprint, tf knows base_link alone: REP 105 has one above the other."""
    written = on_moving(lambda k: ((0, 0, 0), turned()), "odom", "unused", robot="base_footprint")
    log = read(written)
    np.testing.assert_allclose(log.mount, (0.3, 0.1, math.pi / 2), atol=1e-9)
    assert log.report.used["mounting"] == (
        "tf base_link → laser, with base_link for base_footprint, which has no transforms"
    )
    other = [one for one in written if not isinstance(one.content, Odom)]
    other += [Written("/odom", START, Odom(START, 0, 0, 0, "camera"))]
    log = read(sorted(other, key=lambda one: one.log_time))
    assert any("no transforms lead from camera to laser" in warning for warning in log.report.warnings)


def test_scans_in_the_robots_frame_need_no_transforms(read):
    written = [
        one.with_scan(frame="base_link") if isinstance(one.content, Scan) else one for one in drive(mount=())
    ]
    for options in ({}, {"odometry": False}):
        log = read(written, **options)
        assert log.report.used["mounting"] == "none: the scans are in the robot's frame, base_link"
        assert log.report.warnings == ()


def test_transforms_that_are_none_are_passed_over(read):
    """A zero quaternion is no rotation: among others it is left out, and alone it leads nowhere."""
    nothing = (0.0, 0.0, 0.0, 0.0)
    some = on_moving(lambda k: ((0.0, 0.0, 0.1), nothing if k % 2 else turned(pitch=wave(k, 2))))
    np.testing.assert_allclose(read(some).mount, (0.3, 0.1, math.pi / 2), atol=2e-3)
    log = read(on_moving(lambda k: ((0.1 * k, 0.0, 0.0), nothing), robot="other"))
    assert log.report.used["mounting"] == "assumed: at the robot's centre"
