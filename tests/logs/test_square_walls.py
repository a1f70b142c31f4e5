"""The angle between beams by walls that are square to each other: a wrong one of 1 to 8 % is told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.square_walls import told_by_square_walls
from nscan_cli.logs.wall_angles import SampledScans
from tests.benchmarks.stranger_cases import with_own_angles
from tests.data import OFFICE_LOG, data_file
from tests.simulation.faults import beams_apart


def told(log: LaserLog) -> list[str]:
    return [said for said in log.report.contradictions if "walls are" in said or "are bent" in said]


@pytest.fixture
def reread(tmp_path):
    def read(log: LaserLog, options: ReadingOptions = ReadingOptions()) -> LaserLog:
        file = Path(tmp_path, "wrong.log")
        file.write_bytes(with_own_angles(log))
        return read_log(str(file), options)

    return read


@pytest.mark.parametrize("factor", [0.95, 0.97, 0.985, 1.015, 1.03, 1.05])
def test_a_step_that_is_some_percent_off_is_put_right(reread, factor):
    true = read_log(OFFICE_LOG)
    log = reread(beams_apart(true, factor))
    (said,) = told(log)
    assert "walls are square to each other with 1° from beam to beam, 180 beams over 180°; with the" in said
    assert f"{factor:.4g}° of the log they are not: the 1° are used" in said
    assert log.angle_increment == pytest.approx(true.angle_increment)
    assert log.angle_min == pytest.approx(true.angle_min, abs=np.radians(1.01))


def test_as_recorded_believes_the_file(reread):
    wrong = beams_apart(read_log(OFFICE_LOG), 1.03)
    log = reread(wrong, ReadingOptions(as_recorded=True))
    assert log.angle_increment == pytest.approx(wrong.angle_increment)
    assert not told(log)


@pytest.mark.parametrize("length", [-0.1, 0.1])
def test_ranges_that_are_too_long_do_not_look_like_another_angle(reread, length):
    """Their walls are bent, as with a wrong angle, but they are turned in another way."""
    true = read_log(OFFICE_LOG)
    log = reread(replace(true, ranges=true.ranges + np.float32(length)))
    assert log.angle_increment == pytest.approx(true.angle_increment)
    assert not [said for said in told(log) if "from beam to beam" in said]


def test_another_angle_does_not_look_like_ranges_that_are_too_long(reread):
    """The beams of 127°: no usual laser, so the angle is named."""
    true = read_log(OFFICE_LOG)
    part = replace(true, ranges=true.ranges[:, 27:-27], angle_min=true.angle_min + 27 * true.angle_increment)
    (said,) = told(reread(beams_apart(part, 1.06)))
    assert "walls are square to each other" in said
    step = float(said.split("; try --angle-increment ")[1].split()[0])
    assert step == pytest.approx(1.0, rel=0.01)
    assert not told(reread(part))


def test_readings_without_walls_tell_nothing():
    rng = np.random.default_rng(1)
    scans = SampledScans(rng.uniform(1.0, 9.0, (300, 181)), np.full(300, np.radians(1.0)))
    assert told_by_square_walls(lambda count: SampledScans(scans.ranges[:count], scans.steps[:count])) is None
    assert told_by_square_walls(lambda _count: SampledScans(np.zeros((0, 181)), np.zeros(0))) is None


@pytest.mark.parametrize("step", [0.0, 1e-300, 1e300, np.inf, np.nan])
def test_a_damaged_angle_tells_nothing(step):
    scans = SampledScans(np.ones((9, 2)), np.full(9, step))
    with np.errstate(invalid="ignore"):
        assert told_by_square_walls(lambda _count: scans) is None


@pytest.mark.parametrize("factor", [0.95, 1.03])
@pytest.mark.parametrize("name", ["mit-csail", "fr079", "intel"])
def test_a_real_log_with_a_wrong_step_is_put_right(reread, name, factor):
    true = read_log(str(data_file(f"{name}.log.gz")))
    log = reread(beams_apart(true, factor))
    assert len(told(log)) == 1
    assert log.angle_increment == pytest.approx(true.angle_increment, rel=1e-6)


@pytest.mark.parametrize(
    "name",
    [
        *("mit-csail.log.gz", "fr079.log.gz", "intel.log.gz", "mit-killian.log.gz", "fr-campus.log.gz"),
        *("fr-clinic.log.gz", "field/mocap.bag", "field/old-index.bag", "field/urg-carried.bag"),
        *("field/urg-corridor-1.bag", "field/urg-corridor-2.bag", "field/rplidar-floor"),
        *("field/varying-beams.db3", "field/player-2.1.2.log"),
    ],
)
def test_walls_of_a_true_log_are_square(name):
    assert not told(read_log(str(data_file(name))))
