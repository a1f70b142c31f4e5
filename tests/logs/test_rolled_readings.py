"""Readings that begin in the middle of the scan are read in the order of the beams."""

from __future__ import annotations

import dataclasses
import functools
import math
from pathlib import Path

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.benchmarks.stranger_cases import with_own_angles
from tests.data import data_file
from tests.simulation.laser import Laser
from tests.simulation.scenes import office

HALF = Laser(181, math.radians(-90.0), math.radians(1.0), 20.0, no_return=81.0, mount=(0.1, 0.0, 0.0))
WIDE = Laser(271, math.radians(-135.0), math.radians(1.0), 20.0, no_return=81.0, mount=(0.1, 0.05, 0.0))
ROUND = Laser(360, -math.pi, math.radians(1.0), 12.0, no_return=13.0)


@functools.cache
def drive(laser: Laser) -> LaserLog:
    return office().record_at(office().truth()[:200], 4, laser).log()


def rolled(log: LaserLog, beams: int, folder: Path, options: ReadingOptions | None = None) -> LaserLog:
    path = folder / "v.log"
    ranges = np.roll(log.ranges, beams, axis=1)
    path.write_bytes(with_own_angles(dataclasses.replace(log, ranges=ranges)))
    return read_log(str(path), options or ReadingOptions())


def told(log: LaserLog) -> list[str]:
    return [said for said in log.report.contradictions if "begin in the middle" in said]


@pytest.mark.parametrize("laser", [HALF, WIDE])
@pytest.mark.parametrize("beams", [90, 20, 1, -3])
def test_rolled_readings_are_put_right_and_said(tmp_path, laser, beams):
    sound = rolled(drive(laser), 0, tmp_path)
    log = rolled(drive(laser), beams, tmp_path)
    assert not told(sound)
    assert len(told(log)) == 1
    np.testing.assert_array_equal(log.ranges, sound.ranges)


def test_the_file_may_be_believed(tmp_path):
    log = rolled(drive(HALF), 90, tmp_path, ReadingOptions(as_recorded=True))
    assert not told(log)
    assert not np.array_equal(log.ranges, rolled(drive(HALF), 0, tmp_path).ranges)


def test_a_laser_that_sees_all_around_has_no_first_beam(tmp_path):
    assert not told(rolled(drive(ROUND), 90, tmp_path))


def test_a_robot_that_stands_tells_nothing(tmp_path):
    """Both ends may look at walls equally far away, and another beam past an edge."""
    log = drive(HALF)
    ranges = np.repeat(log.ranges[:1], len(log), axis=0)
    assert not told(rolled(dataclasses.replace(log, ranges=ranges), 90, tmp_path))


@pytest.mark.logs
@pytest.mark.parametrize("name", ["intel", "fr079", "mit-killian"])
def test_excerpts_of_real_logs_begin_with_their_first_beam(name):
    path = str(data_file(f"{name}.log.gz"))
    for start in range(0, 1000, 100):
        assert not told(read_log(path, ReadingOptions(start=float(start), end=start + 60.0)))
