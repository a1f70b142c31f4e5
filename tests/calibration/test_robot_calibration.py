"""Robots calibrated from simulated drives: what comes out, and how far it is from the truth."""

from __future__ import annotations

import dataclasses
import functools
import itertools

import numpy as np
import pytest

from nscan_cli.calibration.calibrated_reading import calibrated_reading
from nscan_cli.calibration.estimate import Estimate
from nscan_cli.calibration.options import CalibrationOptions
from nscan_cli.calibration.robot_calibration import Calibration, calibrate
from nscan_cli.errors import InputDataError
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_path import robot_path
from nscan_cli.poses import compose, relative
from tests.benchmarks.laser_kinds import turning
from tests.data import OFFICE_LOG, data_file
from tests.logs.excerpts import excerpt
from tests.simulation import faults, odometry_faults
from tests.simulation.drive import Drive, Odometry
from tests.simulation.laser import Laser
from tests.simulation.office import office_way, office_world
from tests.simulation.scenes import bare_corridor, office
from tests.simulation.sweeping import SweptRecording, Turning, fine_path, record_swept

OPTIONS = CalibrationOptions()
LASERS = (Laser(), Laser(360, -np.pi, np.radians(1.0), 12.0, no_return=13.0))
MOUNTS = ((0.0, 0.0, 0.0), (-0.3, 0.2, 2.5))
"""Without a lever arm, and with one."""
ROBOTS = tuple(itertools.product(LASERS, MOUNTS))
SCALE = 1.0 / Odometry().scale
SEEDS = range(5)
DRIVES = [(*robot, len(SEEDS) * at + seed) for at, robot in enumerate(ROBOTS) for seed in SEEDS]
"""Each with noise of its own."""
TRACK = 0.4
"""m"""
LATE = 0.3
"""s"""


def calibrated(log: LaserLog, reading: ReadingOptions | None = None) -> Calibration:
    return calibrate(log, reading or ReadingOptions(), OPTIONS)


@functools.cache
def drive(laser: Laser, mount: tuple[float, float, float], seed: int) -> LaserLog:
    """60 m through the office, whose file says nothing of the mounting."""
    scene = dataclasses.replace(office(), drive=Drive(period=0.1))
    log = scene.record_at(scene.truth()[:1200], seed, dataclasses.replace(laser, mount=mount)).log()
    return dataclasses.replace(log, mount=np.zeros(3))


@functools.cache
def found(laser: Laser, mount: tuple[float, float, float], seed: int) -> dict[str, Estimate]:
    """What comes out where the clock of odometry is late."""
    return calibrated(odometry_faults.late(drive(laser, mount, seed), LATE)).values


@pytest.mark.parametrize("robot", ROBOTS)
def test_mounting_scale_and_clock_come_out(robot):
    """Medians over the drives: within 1 cm, 0.3°, 0.5 % and 10 ms."""
    off = []
    for laser, mount, seed in (drive for drive in DRIVES if drive[:2] == robot):
        values = found(laser, mount, seed)
        place = np.hypot(values["mount_x"].value - mount[0], values["mount_y"].value - mount[1])
        turned = abs(np.degrees(values["mount_angle"].value - mount[2]))
        scale = abs(values["odometry_scale"].value / SCALE - 1.0)
        off.append((place, turned, scale, abs(values["clock_offset"].value + LATE)))
    assert (np.median(off, axis=0) < (0.01, 0.3, 0.005, 0.01)).all(), np.median(off, axis=0)


def test_errors_are_as_large_as_said():
    """Mean squares of errors in standard deviations: of mounting, of odometry, of all.

    Those of three values of 20 drives have a standard deviation of 0.2 where they are as large as said.
    """
    squares = []
    for laser, mount, seed in DRIVES:
        values = found(laser, mount, seed)
        true = dict(zip(("mount_x", "mount_y", "mount_angle"), mount, strict=True))
        true |= {"odometry_scale": SCALE, "clock_offset": -LATE, "veer": Odometry().veer, "turn_ratio": 1.0}
        true |= {"wheel_difference": -Odometry().veer, "track_width": SCALE}
        squares.append([((values[name].value - at) / values[name].sigma) ** 2 for name, at in true.items()])
    of_values = np.mean(squares, axis=0)
    for mean in (of_values.mean(), of_values[:3].mean(), of_values[3:].mean()):
        assert 0.5 < mean < 2.0, of_values


def unequal_wheels(log: LaserLog, left: float, wider: float) -> LaserLog:
    """The left wheel is so many times as large, and the track so many times as wide, as odometry has it."""
    poses = log.odometry
    assert poses is not None
    steps = relative(poses[1:], poses[:-1])
    told_right, told_left = (
        steps[:, 0] + TRACK / 2 * steps[:, 2],
        (steps[:, 0] - TRACK / 2 * steps[:, 2]) / left,
    )
    steps[:, 0], steps[:, 2] = (told_right + told_left) / 2, (told_right - told_left) / (TRACK / wider)
    told = [poses[0]]
    for step in steps:
        told.append(compose(told[-1], step))
    return dataclasses.replace(log, odometry=np.array(told))


def test_wheels_come_out():
    """The left one is 4 % smaller than odometry takes it for, and the track 5 % wider."""
    off = []
    for one in DRIVES[::3]:
        values = calibrated(unequal_wheels(drive(*one), 0.96, 1.05)).values
        true = {"odometry_scale": 0.98 * SCALE, "track_width": 1.05 * SCALE}
        true |= {"wheel_difference": 0.04 / (0.98 * SCALE) / TRACK - Odometry().veer}
        off.append([(values[name].value - at) / values[name].sigma for name, at in true.items()])
        assert values["wheel_difference"].sigma < 0.005
        assert values["track_width"].sigma < 0.01
    assert 0.3 < np.mean(np.square(off)) < 2.0, off


def test_a_robot_that_goes_sideways_has_no_two_wheels():
    log = drive(*ROBOTS[0], 0)
    assert log.odometry is not None
    turned = dataclasses.replace(log, odometry=log.odometry + np.array([0.0, 0.0, 0.3]))
    values = calibrated(turned).values
    assert values["track_width"].why_open == "odometry goes sideways: it is not of two wheels"
    assert not values["turn_ratio"].is_open


def test_the_noise_is_that_of_the_robots_steps():
    """However far from its middle the laser is: in turns that moves farther than the robot."""
    for laser in LASERS:
        near, far = (
            np.mean([found(laser, mount, seed)["noise_distance"].value for seed in SEEDS]) for mount in MOUNTS
        )
        assert far == pytest.approx(near, rel=0.15)


def test_a_mirrored_laser():
    calibration = calibrated(faults.mirrored(drive(LASERS[0], (0.1, 0.0, 0.0), 0)))
    assert calibration.mirrored
    assert calibration.values["mount_x"].value == pytest.approx(0.1, abs=0.01)
    assert calibrated_reading(calibration, ReadingOptions(), OPTIONS).flip
    assert not calibrated_reading(calibration, ReadingOptions(flip=True), OPTIONS).flip


def test_what_the_file_says_rightly_stays():
    log = read_log(OFFICE_LOG)
    reading = calibrated_reading(calibrated(log), ReadingOptions(), OPTIONS)
    assert reading == ReadingOptions(odometry_scale=reading.odometry_scale)
    assert reading.odometry_scale == pytest.approx(SCALE, abs=0.003)


def test_a_calibrated_robot_needs_no_more():
    log = drive(*ROBOTS[1], 1)
    reading = calibrated_reading(calibrated(log), ReadingOptions(), OPTIONS)
    assert reading.mount is not None
    assert log.odometry is not None
    scale = reading.odometry_scale
    again = dataclasses.replace(log, mount=np.array(reading.mount), odometry=log.odometry * (scale, scale, 1))
    assert calibrated_reading(calibrated(again, reading), reading, OPTIONS) == reading


def test_a_drive_without_turns_leaves_the_place_open():
    log = drive(*ROBOTS[0], 0)
    straight = np.abs(np.gradient(np.unwrap(log.truth[:, 2]))) < 0.003 if log.truth is not None else None
    assert straight is not None
    first = int(np.argmax(np.convolve(straight, np.ones(150), "valid")))
    straight_on = calibrated(excerpt(log, slice(first, first + 150)))
    assert {"mount_x", "mount_y", "turn_ratio", "clock_offset"} <= set(straight_on.open)
    assert np.isfinite(straight_on.values["odometry_scale"].sigma)
    why = {value.why_open for value in straight_on.values.values() if value.is_open}
    assert why <= {"the robot hardly turns", "too few steps go far enough"}
    assert calibrated_reading(straight_on, ReadingOptions(), OPTIONS).mount is None


def test_too_little_is_an_error():
    with pytest.raises(InputDataError, match=r"scans measure the motion of [0-9]+ steps? only"):
        calibrated(bare_corridor().record(1).log())
    with pytest.raises(InputDataError, match="has no odometry"):
        calibrated(dataclasses.replace(drive(*ROBOTS[0], 0), odometry=None))


def test_intel():
    """Its laser is 0.098 m ahead of where the log has it, by the turns of its tracked path."""
    values = calibrated(read_log(str(data_file("intel.log.gz")))).values
    assert values["mount_x"].value == pytest.approx(0.098, abs=0.02)
    assert values["mount_y"].value == pytest.approx(0.0, abs=0.02)


@functools.cache
def swept(turn: float, stamp: str = "first") -> SweptRecording:
    """A drive whose laser takes `turn` s for a turn; odometry is right."""
    path = fine_path(office_way()[:12], Drive(speed=0.22, turn_rate=1.5))
    return record_swept(
        "office", office_world(), path, turning(360, 3.5, 0.01, 0.01), Turning(0.2, turn, stamp), 1
    )


def test_the_steps_of_a_laser_that_turns_are_those_of_one_that_sees_at_once():
    """As the scans are, they would be late by half a turn, and the wheels would seem to slip."""
    at_once, turning_laser = (calibrated(swept(turn).log()) for turn in (0.0, 0.2))
    assert at_once.stamp is None
    assert turning_laser.stamp == "first"
    assert turning_laser.sweep == 0.2
    values = turning_laser.values
    assert values["clock_offset"].value == pytest.approx(0.0, abs=0.02)
    assert values["clock_offset"].sigma < 0.01
    assert values["noise_turn"].value < 1.5 * at_once.values["noise_turn"].value
    assert values["mount_y"].value == pytest.approx(0.0, abs=3 * values["mount_y"].sigma)
    assert values["mount_x"].value == pytest.approx(0.1, abs=0.01)
    assert values["sweep_time"].value == pytest.approx(0.2, abs=3 * values["sweep_time"].sigma)


@pytest.mark.parametrize("told", [0.0, -0.2, 0.2])
def test_a_turn_that_the_file_has_wrongly(told):
    reading = calibrated_reading(calibrated(swept(0.2).log(turn=told)), ReadingOptions(), OPTIONS)
    assert reading.sweep == (None if told == 0.2 else pytest.approx(0.2, abs=0.01))


@pytest.mark.parametrize("stamp", ["middle", "last"])
def test_a_stamp_that_is_not_at_the_first_beam(stamp):
    found = calibrated(swept(0.2, stamp).log(stamp="first"))
    assert found.stamp == stamp
    reading = calibrated_reading(found, ReadingOptions(), OPTIONS)
    assert (reading.stamp, reading.clock_offset) == (stamp, 0.0)


def test_the_clock_of_a_laser_that_turns():
    """A third of a second is no beam of the scan; it is passed on, since beams are corrected by odometry."""
    drive = swept(0.2)
    path = robot_path(drive.odometry.times - 0.3, drive.odometry.poses)
    assert path is not None
    found = calibrated(dataclasses.replace(drive, odometry=path).log())
    assert found.stamp is None
    assert found.values["clock_offset"].value == pytest.approx(0.3, abs=0.02)
    assert calibrated_reading(found, ReadingOptions(), OPTIONS).clock_offset == pytest.approx(0.3, abs=0.02)
