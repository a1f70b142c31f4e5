"""The floor that a tilted laser sees is left out; walls beside a robot that drives along them are not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nscan_cli.logs.floor_line import FloorLine, FloorLineOptions, floor_line
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.data import data_file
from tests.logs.test_robot_parts import as_carmen, narrow, office_log, table_of
from tests.simulation import faults
from tests.simulation.laser import Laser
from tests.simulation.tilted_laser import tilted

MARGIN = FloorLineOptions().margin


def found(log: LaserLog) -> FloorLine | None:
    return floor_line(table_of(log), [])


@pytest.mark.parametrize("degrees", [0.0, 20.0, -90.0])
@pytest.mark.parametrize(
    ("distance", "rocking", "noise"), [(2.0, 0.0, 0.02), (3.0, 0.1, 0.02), (3.0, 0.0, 0.05)]
)
def test_it_is_found_wherever_the_laser_is_tilted_to(degrees, distance, rocking, noise):
    line = found(tilted(office_log(), distance, math.radians(degrees), rocking, noise))
    assert line is not None
    # It is the line of the farthest readings.
    assert distance <= line.distance <= distance * (1.0 + rocking + 2.0 * noise)
    assert abs(np.angle(np.exp(1j * (line.bearing - math.radians(degrees))))) < math.radians(3.0)


def test_walls_and_robots_that_do_not_turn_have_none():
    """Half a metre aside is a wall, a straight line that goes along until the robot turns."""
    assert found(office_log()) is None
    assert found(narrow(4)) is None
    straight = faults.taken(narrow(1), slice(0, 105))
    assert found(straight) is None
    assert found(tilted(straight, 3.0)) is None


def test_a_log_is_read_without_the_floor_and_says_so(tmp_path):
    path = as_carmen(tmp_path, tilted(office_log(Laser()), 3.0))
    read, as_recorded = read_log(path), read_log(path, ReadingOptions(as_recorded=True))
    (said,) = read.report.contradictions
    assert said.startswith(
        "the laser is tilted and sees the floor: at 0° nothing is beyond a straight line at 3.0"
    )
    assert as_recorded.report.contradictions == ()
    floor = np.isnan(read.ranges) & np.isfinite(as_recorded.ranges)
    assert read.report.lost["of the floor"] == np.count_nonzero(floor) > 0.05 * floor.size
    bearings = read.angle_min[0] + read.angle_increment[0] * np.arange(floor.shape[1])
    depths = as_recorded.ranges * np.cos(bearings) / 3.0
    assert floor[np.isfinite(depths) & (depths > 0.95)].all()
    assert not floor[depths < 0.97 - MARGIN].any()
    # What is selected or masked does not change what is found.
    some = ReadingOptions(start=20.0, end=30.0, every=5, mask=((-1.0, -0.9),))
    assert read_log(path, some).report.contradictions == read.report.contradictions


@pytest.mark.parametrize("name", ["mit-csail.log.gz", "fr079.log.gz", "intel.log.gz"])
def test_real_lasers_that_are_level_and_tilted(name):
    log = read_log(str(data_file(name)))
    assert found(log) is None
    line = found(tilted(log, 3.0))
    assert line is not None
    assert line.distance == pytest.approx(3.05, abs=0.05)


@pytest.mark.parametrize(
    "name", ["field/urg-corridor-1.bag", "field/player-2.1.2.log", "fr-clinic.log.gz", "walker.mcap"]
)
def test_other_real_logs_have_none(name):
    assert "of the floor" not in read_log(str(data_file(name))).report.lost
