"""Scans of a laser that turns, as one that sees at once would have taken them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.exports.carmen import corrected_log
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import log_from
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_path import poses_at
from nscan_cli.logs.seen_at_once import ranges_at_once, seen_at_once
from nscan_cli.poses import Array, transform
from tests.simulation.drive import Drive
from tests.simulation.laser import Laser, exact
from tests.simulation.sweeping import Turning, fine_path, record_swept
from tests.simulation.world import Builder

CORNERS = ((-3.0, -2.0), (4.0, 5.0))
PATH = fine_path(np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 3.0)]), Drive(turn_rate=1.0))


def drive(laser: Laser, turn: float) -> LaserLog:
    """In a room, with the true path."""
    room = Builder()
    room.box(*CORNERS[0], *CORNERS[1])
    log = record_swept("room", room.world(), PATH, exact(laser), Turning(turn=turn), 1).log()
    return dataclasses.replace(log, path=PATH)


def off_the_walls(log: LaserLog, poses: Array) -> Array:
    """(P,) m"""
    (left, low), (right, high) = CORNERS
    x, y = np.concatenate([transform(pose, log.points(row)) for row, pose in enumerate(poses)]).T
    off: Array = np.min(np.abs([x - left, x - right, y - low, y - high]), axis=0)
    return off


@pytest.mark.parametrize("turn", [0.2, -0.2])
@pytest.mark.parametrize("laser", [
    Laser(360, -np.pi, np.radians(1), 12.0), Laser(541, -np.radians(135), np.radians(0.5), 12.0),
])  # fmt: skip
def test_points_are_on_the_walls(laser, turn):
    log = drive(laser, turn)
    found = seen_at_once(log)
    assert found.beam_times is None
    assert np.isfinite(found.ranges).mean() > 0.9
    off = off_the_walls(found, poses_at(PATH, log.times))
    uncorrected = off_the_walls(dataclasses.replace(log, path=None), poses_at(PATH, log.times))
    # Half a beam beside where the point is.
    assert np.quantile(off, 0.95) < 0.03
    assert np.quantile(uncorrected, 0.95) > 0.1


def test_a_laser_that_sees_at_once_keeps_its_ranges():
    log = drive(Laser(90, -np.pi, np.radians(4), 12.0), 0.0)
    assert seen_at_once(log) is log
    np.testing.assert_array_equal(ranges_at_once(log, np.array([3, 5])), log.ranges[[3, 5]])


def test_beams_without_return_keep_none():
    log = drive(Laser(90, -np.pi, np.radians(4), 12.0), 0.2)
    blind = dataclasses.replace(log, ranges=np.full_like(log.ranges, np.inf))
    np.testing.assert_array_equal(seen_at_once(blind).ranges, blind.ranges)


def test_a_carmen_log_has_them():
    log = drive(Laser(360, -np.pi, np.radians(1), 12.0), 0.2)
    poses = poses_at(PATH, log.times)
    text = corrected_log(dataclasses.replace(log, path=None), np.arange(len(log)), poses)
    read = log_from(text, "room.log", ReadingOptions(odometry=False))
    assert np.quantile(off_the_walls(read, poses), 0.9) < 0.05
