"""The length by which ranges are too long, by walls that are square to each other."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.square_length import SquareLength, length_by_square_walls
from tests.data import OFFICE_LOG, data_file
from tests.logs.excerpts import excerpt
from tests.simulation.faults import beams_apart


@pytest.fixture(scope="module")
def office() -> LaserLog:
    return read_log(OFFICE_LOG)


def told(log: LaserLog, added: float = 0.0, scans: int = 2000) -> SquareLength | None:
    ranges = (log.ranges + np.float32(added))[:scans]
    return length_by_square_walls(ranges, log.angle_increment[:scans], False)


@pytest.mark.parametrize("added", [-0.2, -0.1, 0.05, 0.1, 0.3])
def test_the_length_is_told(office, added):
    found = told(office, added)
    assert found is not None
    assert found.is_steady
    assert found.length == pytest.approx(added, abs=0.025)
    assert found.gain > 1.0 + 2.5 * abs(added)


def test_nothing_is_told_of_ranges_that_are_right(office):
    found = told(office)
    assert found is not None
    assert abs(found.length) < 0.01
    assert found.gain == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("factor", [0.97, 1.03])
def test_a_wrong_angle_between_beams_is_told_apart(office, factor):
    found = told(beams_apart(office, factor))
    assert found is not None
    assert abs(found.length) < 0.03


def test_few_walls_and_random_ranges_tell_nothing(office):
    assert told(office, scans=3) is None
    ranges = np.random.default_rng(1).uniform(0.5, 6.0, (400, 181)).astype(np.float32)
    assert length_by_square_walls(ranges, np.full(400, np.radians(1.0)), False) is None
    assert length_by_square_walls(ranges, np.zeros(400), False) is None


def test_a_view_that_is_nearly_a_whole_turn_tells_nothing():
    """Its angle between beams and its ranges are hardly told apart."""
    ranges = np.full((400, 353), 2.0, np.float32)
    assert length_by_square_walls(ranges, np.full(400, np.radians(1.0)), False) is None


def test_a_length_beyond_those_that_were_tried_is_none():
    """Beams twice as far apart as they are cover a whole turn here, and are taken to be right."""
    log = excerpt(read_log(str(data_file("mit-killian.log.gz"))), slice(2000, 3800))
    assert length_by_square_walls(log.ranges, 2.0 * log.angle_increment, True) is None
