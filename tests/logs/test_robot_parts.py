"""Beams that see the robot itself are found and left out; walls along which it drives are not."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from nscan_cli.errors import WrongUsageError
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.range_limits import RangeLimits
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_parts import ScanTable, Sector, robot_parts
from nscan_cli.poses import compose
from tests.data import data_file
from tests.simulation import faults, things_beside
from tests.simulation.building import building, drive
from tests.simulation.drive import Drive
from tests.simulation.laser import Laser
from tests.simulation.recording import record
from tests.simulation.scenes import office
from tests.simulation.world import Builder

ROUND_LASER = Laser(360, -math.pi, math.pi / 180, max_range=12.0, no_return=13.0)


@functools.cache
def office_log(laser: Laser = ROUND_LASER) -> LaserLog:
    return office().record_at(office().truth()[:400], seed=3, laser=laser).log()


def table_of(log: LaserLog) -> ScanTable:
    everything = np.full(len(log), -1.0), np.full(len(log), np.inf)
    limits = RangeLimits(*everything, None, "", "")
    return ScanTable(log.ranges, limits, log.angle_min, log.angle_increment, np.arange(len(log)), log.times)


def found(log: LaserLog) -> list[Sector]:
    return robot_parts(table_of(log))


def sectors(*degrees: tuple[float, float, float]) -> list[tuple[float, float, float]]:
    """Whole beams from one bearing to another (degrees), at a distance (m)."""
    return [
        (math.radians(first - 0.5), math.radians(last + 0.5), distance) for first, last, distance in degrees
    ]


def check(log: LaserLog, parts: list[tuple[float, float, float]]) -> None:
    """Every part is found, and no more than 2.5° beyond it."""
    there = found(things_beside.own_parts(log, parts))
    assert len(there) == len(parts)
    for sector, (first, last, distance) in zip(there, parts, strict=True):
        assert first - math.radians(2.5) <= sector.first <= first
        assert last <= sector.last <= last + math.radians(2.5)
        assert sector.range == pytest.approx(distance, abs=0.02)


@pytest.mark.parametrize(
    "parts",
    [
        sectors((43, 47, 0.3), (133, 137, 0.35)),
        sectors((-170, -120, 0.6), (35, 55, 0.2)),
        sectors((100, 101, 0.4)),
        sectors((-90, -60, 1.2)),
        sectors((-15, 15, 2.2)),
    ],
)
def test_posts_wheels_and_a_cart_are_found(parts):
    check(office_log(), parts)


@pytest.mark.parametrize("noise", [0.0, 0.015])
def test_whatever_the_noise(noise):
    parts = sectors((43, 63, 0.3))
    (sector,) = found(things_beside.own_parts(office_log(), parts, noise))
    assert sector.first <= parts[0][0]
    assert parts[0][1] <= sector.last


def test_a_laser_of_half_a_turn_that_counts_clockwise():
    log = things_beside.own_parts(office_log(Laser()), sectors((-60, -40, 0.3)))
    clockwise = dataclasses.replace(
        log,
        ranges=np.ascontiguousarray(log.ranges[:, ::-1]),
        angle_min=log.angle_min + 179 * log.angle_increment,
        angle_increment=-log.angle_increment,
    )
    np.testing.assert_allclose(found(clockwise), found(log), atol=1e-9)
    assert len(found(log)) == 1


def test_an_office_has_none():
    assert found(office_log()) == []


def narrow(sides: int) -> LaserLog:
    """A robot in the middle of a corridor of 1 m, along sides of a square of 12 m, turning at the corners."""
    plan = Builder()
    for low, high in ((-0.5, 12.5), (0.5, 11.5)):
        corners = [(low, low), (high, low), (high, high), (low, high), (low, low)]
        for (ax, ay), (bx, by) in itertools.pairwise(corners):
            plan.line(ax, ay, bx, by)
    along, turned = np.linspace(0.0, 12.0, 109), np.linspace(0.0, math.pi / 2, 19)
    ahead = np.stack([along, 0 * along, 0 * along], axis=1)
    turning = np.stack([np.full_like(turned, 12.0), 0 * turned, turned], axis=1)
    side = np.concatenate([ahead, turning])
    corner, truth = np.zeros(3), []
    for _ in range(sides):
        truth.append(compose(corner, side))
        corner = truth[-1][-1]
    return record("narrow", plan.world(), np.concatenate(truth), ROUND_LASER, seed=1).log()


def test_walls_half_a_metre_aside_are_none():
    """Along the walls beams keep their range; the robot turns at the corners alone."""
    log = narrow(4)
    beside = log.ranges[:, [90, 270]]
    assert np.mean(np.abs(beside - 0.5) < 0.05) > 0.8
    assert found(log) == []


def test_without_a_turn_nothing_is_told():
    straight = faults.taken(narrow(1), slice(0, 105))
    assert found(straight) == []
    assert found(things_beside.own_parts(straight, sectors((30, 40, 0.3)))) == []


def test_in_a_narrow_corridor_posts_are_found_and_walls_are_not():
    check(narrow(4), sectors((43, 53, 0.3), (120, 130, 0.3)))


def test_a_robot_that_stands_sees_nothing_of_itself():
    standing = office().record_at(
        np.repeat(office().truth()[100:101], 100, axis=0), seed=2, laser=ROUND_LASER
    )
    assert found(standing.log()) == []


def as_carmen(tmp_path, log: LaserLog) -> str:
    """The path of a CARMEN log with the readings of a log."""
    recording = office().record_at(office().truth()[: len(log)], seed=3, laser=Laser())
    readings = np.where(np.isfinite(log.ranges), log.ranges, recording.readings)
    path = tmp_path / "robot.log"
    path.write_bytes(dataclasses.replace(recording, readings=readings).carmen())
    return str(path)


def test_a_log_is_read_without_them_and_says_so(tmp_path):
    log = things_beside.own_parts(office_log(Laser()), sectors((40, 60, 0.3)))
    path = as_carmen(tmp_path, log)
    read = read_log(path)
    (said,) = read.report.contradictions
    assert "keep their range (0.30 m)" in said
    assert "as by --mask 39:61;" in said
    assert np.isnan(read.ranges[:, 129:152]).all()
    assert np.isfinite(read.ranges[:, :129]).mean() > 0.9
    assert read.report.lost["in masked sectors"] == 23 * len(read)
    # What is selected does not change what is found.
    some = read_log(path, ReadingOptions(start=20.0, end=30.0, every=5))
    assert some.report.contradictions == read.report.contradictions
    assert np.isnan(some.ranges[:, 129:152]).all()


def test_of_several_lasers_it_is_said_which_one(tmp_path):
    path = Path(as_carmen(tmp_path, things_beside.own_parts(office_log(Laser()), sectors((40, 60, 0.3)))))
    other = [line.replace("FLASER", "RLASER") for line in path.read_text().splitlines() if "FLASER" in line]
    path.write_text("\n".join([path.read_text(), *other]))
    (said,) = read_log(str(path), ReadingOptions(laser="FLASER")).report.contradictions
    assert said.startswith("FLASER: beams keep their range (0.30 m)")


def test_the_options_decide(tmp_path):
    log = things_beside.own_parts(office_log(Laser()), sectors((40, 60, 0.3)))
    path = as_carmen(tmp_path, log)
    as_recorded = read_log(path, ReadingOptions(as_recorded=True))
    assert as_recorded.report.contradictions == ()
    assert np.isfinite(as_recorded.ranges[:, 130:151]).all()
    masked = read_log(path, ReadingOptions(mask=((math.radians(70.5), math.radians(-80.5)),)))
    assert masked.report.contradictions == ()
    hidden = np.isnan(masked.ranges).all(axis=0)
    np.testing.assert_array_equal(np.flatnonzero(hidden), [*range(10), *range(161, 180)])
    with pytest.raises(WrongUsageError, match="--mask has a bearing or a range that is not a finite number"):
        ReadingOptions(mask=((math.nan, 1.0),))
    with pytest.raises(WrongUsageError, match="--mask leaves out no reading nearer than 0"):
        ReadingOptions(mask=((0.0, 1.0, 0.0),))


def test_a_range_keeps_what_is_farther(tmp_path):
    path = as_carmen(tmp_path, office_log(Laser()))
    whole = read_log(path, ReadingOptions(as_recorded=True))
    near = read_log(path, ReadingOptions(mask=((math.radians(69.5), math.radians(-79.5), 1.5),)))
    masked = np.isnan(near.ranges) & ~np.isnan(whole.ranges)
    inside = np.zeros(masked.shape, dtype=bool)
    inside[:, [*range(11), *range(160, 180)]] = True
    np.testing.assert_array_equal(masked, inside & (whole.ranges < 1.5))
    assert near.report.lost["in masked sectors"] == masked.sum() > 0
    both = ((math.radians(69.5), math.radians(-79.5), 1.5), (math.radians(80.5), math.radians(100.0)))
    assert np.isnan(read_log(path, ReadingOptions(mask=both)).ranges[:, 171:]).all()


LOGS = ["intel.log.gz", "fr079.log.gz", "mit-csail.log.gz", "mit-killian.log.gz", "fr-campus.log.gz",
        "fr-clinic.log.gz", "walker.mcap", "field/mocap.bag", "field/old-index.bag", "field/player-2.1.2.log",
        "field/rplidar-hallway.bag", "field/standing.bag", "field/urg-carried.bag",
        "field/urg-corridor-1.bag", "field/urg-corridor-2.bag", "field/varying-beams.db3"]  # fmt: skip


@pytest.mark.logs
@pytest.mark.parametrize("name", LOGS)
def test_real_logs_have_none(name):
    log = read_log(str(data_file(name)))
    assert not any("--mask" in said for said in log.report.contradictions)


@pytest.mark.logs
@pytest.mark.parametrize(
    ("topic", "said"), [("/left_scan", "-136:-"), ("/right_scan", "-136:-"), ("/rear_scan", "-136:-")]
)
def test_a_wheelchair_sees_itself_at_both_ends_of_its_lasers(topic, said):
    log = read_log(str(data_file("field/three-lasers.bag")), ReadingOptions(topic=topic))
    assert f"--mask {said}" in log.report.contradictions[0]


@pytest.mark.logs
@pytest.mark.parametrize(
    ("name", "distance"), [("intel.log.gz", 0.3), ("fr079.log.gz", 0.3), ("mit-csail.log.gz", 0.3)]
)
def test_posts_in_real_logs(name, distance):
    check(read_log(str(data_file(name))), sectors((-60, -40, distance), (40, 60, distance)))


@pytest.mark.logs
@pytest.mark.parametrize("name", ["posts", "shadow"])
def test_the_recordings_of_strangers(name):
    log = read_log(str(data_file(f"strangers/{name}.mcap")))
    assert "--mask -1" in log.report.contradictions[0]


@pytest.mark.parametrize("seed", [100, 112, 141])
def test_walls_of_a_corridor_before_a_corner_and_behind_it_are_no_parts(seed):
    """Both corridors are as wide, and a turn is short: most scans around it see walls at one distance."""
    laser = Laser(360, -math.pi / 2, math.pi / 359, 10.0, resolution=0.001, mount=(0.3, 0.0, 0.0))
    place = building(1, 1, seed)
    waypoints = place.crossings([(1, 1), (0, 1), (0, 0), (1, 0), (1, 1), (1, 0), (0, 0)])
    log = drive(place, waypoints, "building", 700, laser, Drive(0.8, 1.2, 0.1), seed).log()
    assert log.report.masked == ()
    assert robot_parts(table_of(log)) == []
