"""Odometry that is made to agree with the scans where it is open what is wrong."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import MIRRORED, compose, inverse, relative, wrap
from tests.calibration.test_file_check import central, drive, found
from tests.data import data_file
from tests.simulation import faults, odometry_faults


@pytest.mark.parametrize("mount", [(0.2, 0.0, 0.0), (0.1, 0.3, 0.7)])
def test_odometry_agrees_with_readings_in_the_wrong_order(mount):
    """Whatever the mounting, the laser moves as the scans show it."""
    log, laser = drive(), np.array(mount)
    assert log.odometry is not None
    poses = compose(log.odometry, compose(log.mount, inverse(laser)))
    checked = checked_file(
        faults.mirrored(replace(log, odometry=poses, mount=laser)), ReadingOptions(), FileCheckOptions()
    )
    assert "odometry is mirrored as well" in checked.messages[0]
    assert checked.log.odometry is not None
    assert found(checked.log) == []
    path, mirrored = log.laser_pose(log.odometry), checked.log.laser_pose(checked.log.odometry)
    image = relative(path, path[0]) * MIRRORED
    np.testing.assert_allclose(relative(mirrored, mirrored[0]), image, atol=1e-9)


def aside(log: LaserLog) -> LaserLog:
    """The drive with its laser 0.3 m to the left of where it was: odometry is that of the moved middle."""
    assert log.odometry is not None
    moved = np.array([0.0, -0.3, 0.0])
    return replace(log, odometry=compose(log.odometry, moved), mount=log.mount - moved)


def test_a_laser_aside_tells_mirrored_readings_from_odometry_that_turns_the_wrong_way():
    (mirrored,) = found(faults.mirrored(aside(drive())))
    assert re.search("in the wrong order, and the map is mirrored: .*; try --flip$", mirrored)
    log = aside(drive())
    assert log.odometry is not None
    (turning,) = found(replace(log, odometry=log.odometry * (1.0, -1.0, -1.0)))
    assert re.search("odometry turns the wrong way: .*; odometry is mirrored, so", turning)


def turned(log: LaserLog) -> LaserLog:
    """The drive with a laser that looks 90° to the left."""
    quarter = np.array([0.0, 0.0, np.pi / 2])
    return replace(faults.turned_in(log, -np.pi / 2, slice(None)), mount=compose(log.mount, quarter))


def test_a_laser_that_looks_aside_tells_them_as_well():
    (mirrored,) = found(faults.mirrored(turned(central(drive()))))
    assert re.search("in the wrong order, and the map is mirrored: .*; try --flip$", mirrored)
    (turning,) = found(odometry_faults.turning(turned(central(drive())), -1.0))
    assert re.search("odometry turns the wrong way: .*; odometry is mirrored, so", turning)


@pytest.mark.parametrize("make", [drive, lambda: aside(drive()), lambda: central(drive())])
def test_odometry_that_drives_and_turns_backward_is_reversed(make):
    log = make()
    assert log.odometry is not None
    checked = checked_file(odometry_faults.backward(log), ReadingOptions(), FileCheckOptions())
    (said,) = checked.messages
    assert "odometry likely counts both wheels backward" in said
    # A laser aside tells it from mirrored readings.
    assert said.endswith("uses it as it is" if log.mount[1] > 0.1 else "try --flip --odometry-scale -1")
    assert checked.log.odometry is not None
    moved, right = checked.log.laser_pose(checked.log.odometry), log.laser_pose(log.odometry)
    np.testing.assert_allclose(relative(moved, moved[0]), relative(right, right[0]), atol=1e-9)


def test_both_of_mirrored_readings_and_backward_odometry_are_named_where_the_laser_is_aside():
    log = odometry_faults.scaled(faults.mirrored(aside(drive())), -1.0)
    order, direction = found(log)
    assert order.endswith("try --flip")
    assert "try --odometry-scale -1, or" in direction


def test_a_sign_of_odometry_may_hide_readings_in_the_wrong_order():
    """Of two signs of one, and of mirrored readings with the other one, the scans are the same."""
    log = drive()
    assert log.odometry is not None
    for signs in ((1.0, -1.0, 1.0), (1.0, 1.0, -1.0)):
        (said,) = found(replace(log, odometry=log.odometry * signs))
        assert said.endswith("in the wrong order as well: try --flip")


@pytest.mark.parametrize("degrees", [0.0, 30.0])
def test_odometry_that_turns_the_wrong_way_is_mirrored_also_with_a_wrong_mounting(degrees: float):
    log = aside(drive())
    assert log.odometry is not None
    file = replace(log, mount=log.mount + np.array([0.0, 0.0, np.radians(degrees)]))
    opposite = replace(file, odometry=log.odometry * MIRRORED)
    checked = checked_file(opposite, ReadingOptions(), FileCheckOptions())
    assert checked.log.odometry is not None
    # The laser moves as without any fault.
    right = log.laser_pose(log.odometry)
    moved = checked.log.laser_pose(checked.log.odometry)
    np.testing.assert_allclose(relative(moved, moved[0]), relative(right, right[0]), atol=0.2)
    if degrees:
        assert "laser likely looks 30° further to the right" in checked.messages[1]


@pytest.mark.parametrize("make", [faults.mirrored, lambda log: odometry_faults.turning(log, -1.0)])
def test_opposite_turns_are_found_where_their_sizes_vary(make):
    """Its odometry is late, so turns differ by half of their size in the median."""
    log = read_log(str(data_file("field/urg-corridor-2.bag")))
    (said,) = found(make(replace(log, odometry_path=None)))
    assert re.search("in the wrong order, and the map is mirrored: .*try --flip", said)


@pytest.mark.parametrize("turn", [0.3, -np.pi / 2, np.pi])
@pytest.mark.parametrize("make", [faults.mounted_otherwise, odometry_faults.heading_elsewhere])
def test_odometry_of_a_laser_that_looks_elsewhere_agrees_with_the_scans(make, turn):
    """The laser moves as it did, whatever is wrong; so no drive is mapped against its odometry."""
    recorded = drive()
    log = checked_file(make(recorded, turn), ReadingOptions(), FileCheckOptions()).log
    assert recorded.odometry is not None
    assert log.odometry is not None
    assert found(log) == []
    path, other = (each.laser_pose(odometry) for each, odometry in (
        (recorded, recorded.odometry), (log, log.odometry)
    ))  # fmt: skip
    off = relative(path, path[0]) - relative(other, other[0])
    assert np.abs(off[:, :2]).max() < 0.05
    assert np.abs(wrap(off[:, 2])).max() < 0.01


def test_the_length_of_odometry_agrees_where_it_is_clearly_another():
    log = odometry_faults.scaled(drive(), 1.5)
    checked = checked_file(log, ReadingOptions(), FileCheckOptions())
    assert "meanwhile odometry is changed" in checked.messages[0]
    recorded = drive().odometry
    assert recorded is not None
    assert checked.log.odometry is not None
    np.testing.assert_allclose(checked.log.odometry, recorded, rtol=0.02, atol=1e-6)
    assert found(checked.log) == []
    slightly = odometry_faults.scaled(drive(), 0.9)
    assert checked_file(slightly, ReadingOptions(), FileCheckOptions()).log is slightly


def test_odometry_in_another_unit_agrees_in_that_of_the_mounting():
    """The laser is 0.1 m ahead of the middle, and 0.1 m by odometry is as nothing."""
    log = faults.mounted_otherwise(odometry_faults.scaled(drive(), 1000.0), -np.pi / 2)
    other = faults.mounted_otherwise(drive(), -np.pi / 2)
    (one, two) = (checked_file(each, ReadingOptions(), FileCheckOptions()).log for each in (log, other))
    assert one.odometry is not None
    assert two.odometry is not None
    np.testing.assert_allclose(one.odometry, two.odometry, atol=0.01)
