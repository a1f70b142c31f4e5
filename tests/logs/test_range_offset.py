"""Ranges that all are too long or too short by one length, told by walls."""

from __future__ import annotations

import functools
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.range_offset import checked_offset
from nscan_cli.logs.reading_options import ReadingOptions
from tests.benchmarks.stranger_cases import with_own_angles
from tests.data import SAMPLE_LOGS, data_file
from tests.logs.excerpts import excerpt
from tests.simulation.laser import Laser
from tests.simulation.scenes import office

SOUND = ["intel", "fr079", "mit-csail", "mit-killian", "fr-campus", "fr-clinic"]
URGS = ["field/urg-corridor-1.bag", "field/urg-corridor-2.bag", "field/urg-carried.bag"]
"""They measure 0.04 to 0.05 m too long."""


@pytest.fixture(scope="module")
def sample() -> LaserLog:
    return read_log(str(SAMPLE_LOGS / "office.log.gz"))


def offset(log: LaserLog, added: float, reading: ReadingOptions = ReadingOptions()) -> float:
    return checked_offset(log.ranges + np.float32(added), log.angle_increment, reading)[0]


@pytest.mark.parametrize("added", [-0.15, -0.1, 0.1, 0.15])
def test_what_all_ranges_have_too_much_is_taken_off(sample: LaserLog, added: float):
    assert offset(sample, added) == pytest.approx(-added, abs=0.03)


def said_of(log: LaserLog, added: float) -> list[str]:
    return checked_offset(log.ranges + np.float32(added), log.angle_increment, ReadingOptions())[1]


@functools.cache
def wide() -> LaserLog:
    laser = Laser(541, np.radians(-135.0), np.radians(0.5), 20.0, no_return=81.0, mount=(0.1, 0.05, 0.0))
    return office().record_at(office().truth()[:600], 3, laser).log()


@pytest.mark.parametrize("added", [0.1, 0.15])
def test_a_laser_of_270_degrees(added: float):
    assert offset(wide(), 0.0) == 0.0
    assert offset(wide(), added) == pytest.approx(-added, abs=0.03)


def test_far_walls_that_are_square_tell_what_bent_ones_leave_open():
    """Far walls tell a little more than near ones, as with a wrong angle between beams."""
    assert offset(wide(), -0.1) == pytest.approx(0.1, abs=0.02)


def test_beams_that_are_a_whole_turn_leave_the_ranges_alone():
    scene = office()
    laser = Laser(360, -np.pi, np.radians(1.0), 12.0, no_return=13.0, mount=(0.2, 0.0, 0.0))
    log = scene.record_at(scene.truth()[250:850], 11, laser).log()
    assert said_of(log, 0.0) == []
    assert offset(log, -0.1) == pytest.approx(0.1, abs=0.03)


def test_a_length_that_is_not_beyond_doubt_is_named(sample: LaserLog):
    assert said_of(sample, 0.0) == said_of(sample, 0.02) == []
    assert offset(sample, 0.05) == 0.0
    (said,) = said_of(sample, 0.05)
    assert re.search(r"likely 0\.0\d m too long: .*try --range-offset -0\.0\d;", said)


def test_the_log_is_read_without_it_and_says_so(sample: LaserLog, tmp_path: Path):
    path = tmp_path / "long.log"
    path.write_bytes(with_own_angles(replace(sample, ranges=sample.ranges + np.float32(0.12))))
    log = read_log(str(path))
    (said,) = [each for each in log.report.contradictions if "m too long" in each]
    assert "as by --range-offset -0.1" in said
    seen = np.isfinite(log.ranges) & np.isfinite(sample.ranges)
    assert abs(float(np.median(log.ranges[seen] - sample.ranges[seen]))) < 0.03
    # Readings of no return stay what they are.
    np.testing.assert_array_equal(np.isinf(log.ranges), np.isinf(sample.ranges))
    # The option gives what is added, and no more is looked for.
    given = read_log(str(path), ReadingOptions(range_offset=-0.12))
    np.testing.assert_allclose(given.ranges[seen], sample.ranges[seen], atol=0.006)
    assert not any("m too long" in each for each in given.report.contradictions)
    recorded = read_log(str(path), ReadingOptions(as_recorded=True))
    assert float(np.median(recorded.ranges[seen] - sample.ranges[seen])) == pytest.approx(0.12, abs=0.006)


def test_random_ranges_tell_nothing(sample: LaserLog):
    ranges = np.random.default_rng(1).uniform(0.5, 6.0, (400, 181)).astype(np.float32)
    assert checked_offset(ranges, np.full(400, np.radians(1.0)), ReadingOptions()) == (0.0, [])
    assert checked_offset(ranges[:0], np.zeros(0), ReadingOptions()) == (0.0, [])


def test_round_screens_about_a_table_tell_nothing():
    """Three quarters of the walls told 0.3 m, all from the second half of the log."""
    log = read_log(str(data_file("walker.mcap")))
    assert "range_offset" not in log.report.used


@pytest.mark.parametrize("name", [*(f"{name}.log.gz" for name in SOUND), *URGS])
def test_sound_logs_stay_as_they_are(name: str):
    log = read_log(str(data_file(name)))
    assert "range_offset" not in log.report.used
    assert not any("the ranges are likely" in said for said in log.report.contradictions)


@pytest.mark.parametrize("name", ["mit-csail", "intel", "fr079"])
def test_real_logs_whose_ranges_are_15_cm_too_long(name: str):
    log = read_log(str(data_file(f"{name}.log.gz")))
    # Clutter looks like walls that are bent the other way.
    assert offset(log, 0.15) == pytest.approx(-0.15, abs=0.06)


@pytest.mark.parametrize(
    ("name", "rows", "added"),
    [("fr079", (600, 1800), 0.1), ("fr079", (2800, 4200), -0.2)]
    + [("intel", (6000, 9000), added) for added in (-0.1, 0.15)]
    + [("mit-csail", (900, 1900), -0.1), ("mit-killian", (6392, 7892), -0.1)],
)
def test_walls_that_are_square_tell_it_where_clutter_looks_like_bent_walls(name, rows, added):
    """By bent walls the first was 0.24 m too long, and intel 0.05 m too short as it is."""
    log = excerpt(read_log(str(data_file(f"{name}.log.gz"))), slice(*rows))
    assert offset(log, 0.0) == 0.0
    assert offset(log, added) == pytest.approx(-added, abs=0.05)


def test_a_length_that_two_kinds_of_walls_tell_in_part_only_is_not_taken():
    """Bent walls tell 0.22 m here, and parts of the log something else."""
    log = excerpt(read_log(str(data_file("intel.log.gz"))), slice(5172, 5872))
    assert offset(log, 0.0) == offset(log, -0.1) == 0.0
