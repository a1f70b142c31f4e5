"""The turn of a laser as its file has it, against the scans."""

from __future__ import annotations

import dataclasses
import functools
import itertools

import numpy as np
import pytest

from nscan_cli.calibration.file_check import CheckedFile, checked_file
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.scan_motion import ScanMotion
from nscan_cli.calibration.sweep_evidence import sweep_evidence
from nscan_cli.logs.load import log_from, read_log
from nscan_cli.logs.log_excerpt import excerpt
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_path import poses_at, robot_path
from nscan_cli.poses import relative
from tests.benchmarks.laser_kinds import turning
from tests.data import data_file
from tests.simulation.building import building
from tests.simulation.drive import Drive
from tests.simulation.laser import Laser
from tests.simulation.office import office_way, office_world
from tests.simulation.other_forms import swept_mcap
from tests.simulation.sweeping import SweptRecording, Turning, fine_path, record_swept

PERIOD, BEAMS = 0.2, 360


@functools.cache
def driven(turn: float, rate: float, stamp: str = "first", seed: int = 1, points: int = 12) -> SweptRecording:
    """A drive through the office with turns at a rate (rad/s); a turn of the laser takes `turn` s."""
    path = fine_path(office_way()[:points], Drive(speed=0.22, turn_rate=rate))
    laser = turning(BEAMS, 3.5, 0.01, 0.01)
    return record_swept("office", office_world(), path, laser, Turning(PERIOD, turn, stamp), seed)


def recording(turn: float, rate: float = 2.8, told: float | None = None) -> bytes:
    """Such a drive as a file that says that a turn of the laser takes `told` s."""
    return swept_mcap(driven(turn, rate), time_increment=None if told is None else told / BEAMS)


def checked(data: bytes, reading: ReadingOptions | None = None) -> CheckedFile:
    reading = reading or ReadingOptions()
    return checked_file(log_from(data, "office.mcap", reading), reading, FileCheckOptions())


@pytest.mark.parametrize(("turn", "rate", "told", "used", "said"), [
    (PERIOD, 2.8, None, None, ""),
    (0.0, 2.8, 0.0, None, ""),
    (PERIOD, 2.8, 0.0, PERIOD, "the laser turns for 0.2 s, though the file has no times of beams"),
    (PERIOD, 0.5, 0.0, PERIOD, "the laser turns for 0.2 s, though the file has no times of beams"),
    (PERIOD, 2.8, -PERIOD, PERIOD, "the readings are in the reverse order of time"),
    (-PERIOD, 0.5, PERIOD, -PERIOD, "the readings are in the reverse order of time"),
    (0.0, 2.8, PERIOD, 0.0, "the laser sees all beams at once, though the file has times of beams"),
    (0.0, 0.8, 0.2 * PERIOD, 0.0, "the laser sees all beams at once, though the file has times of beams"),
    (0.2 * PERIOD, 0.8, 0.2 * PERIOD, None, ""),
    (PERIOD, 0.5, 0.5 * PERIOD, PERIOD, "the laser turns for 0.2 s, not for 0.1 s as the file says"),
    (PERIOD, 2.8, 0.5 * PERIOD, PERIOD, "the laser turns for 0.2 s, not for 0.1 s as the file says"),
    (0.5 * PERIOD, 0.8, PERIOD, 0.5 * PERIOD, "the laser turns for 0.1 s, not for 0.2 s as the file says"),
])  # fmt: skip
def test_the_scans_say_whether_and_how_the_laser_turns(turn, rate, told, used, said):
    found = checked(recording(turn, rate, told))
    assert (found.reading.sweep is None) if used is None else found.reading.sweep == pytest.approx(used)
    if not said:
        assert found.messages == []
        return
    (message,) = found.messages
    assert message.startswith(said)
    assert f"--sweep {used:.3g}" in message if used else "--sweep off" in message
    if used:
        assert found.log.beam_times is not None
        np.testing.assert_allclose(found.log.beam_times.step, used / BEAMS, rtol=1e-4)
    else:
        assert found.log.beam_times is None


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_pair_of_scans_that_slipped_does_not_hide_a_laser_that_turns(seed):
    found = checked(swept_mcap(driven(PERIOD, 1.5, seed=seed), time_increment=0.0))
    assert found.reading.sweep == pytest.approx(PERIOD)


def test_a_laser_may_turn_for_a_part_of_the_time_from_scan_to_scan():
    found = checked(recording(0.5 * PERIOD, 0.5, 0.0)).reading.sweep
    assert found == pytest.approx(0.5 * PERIOD, rel=0.05)


def half_of(whole: SweptRecording) -> SweptRecording:
    """Every second scan of it."""
    rows = slice(None, None, 2)
    return dataclasses.replace(
        whole, times=whole.times[rows], truth=whole.truth[rows], readings=whole.readings[rows]
    )


@pytest.mark.parametrize("told", [0.0, 2 * PERIOD, PERIOD])
def test_every_second_scan_may_be_missing(told):
    """The laser turns for half of the time from scan to scan; its doubled time of beams was believed."""
    found = checked(swept_mcap(half_of(driven(PERIOD, 1.0)), time_increment=told / BEAMS, scan_time=0.0))
    assert (found.reading.sweep or told) == pytest.approx(PERIOD, rel=0.05)


def test_turns_that_are_shorter_than_three_scans_tell_less():
    """The rates between such scans are too low, and the time of the laser's turn came out 15 % too long."""
    path = fine_path(office_way()[20:32], Drive(speed=0.4, turn_rate=1.0))
    drive = record_swept("office", office_world(), path, turning(BEAMS, 6.0, 0.015, 0.01), Turning(), 101)
    found = checked(swept_mcap(half_of(drive), time_increment=0.0, scan_time=0.0)).reading.sweep
    assert found == pytest.approx(PERIOD)


def test_where_few_scans_tell_of_a_turn_more_of_their_beams_are_matched():
    """By the first 24 pairs and half of the beams it was in doubt."""
    place = building(1, 1, 117)
    laser = Laser(600, np.radians(135), -np.radians(270 / 599), 12.0, noise=0.015, resolution=0.001)
    way = place.crossings([(0, 1), (1, 1), (1, 0), (0, 0), (0, 1), (1, 1)])
    whole = fine_path(way, Drive(speed=0.5, turn_rate=1.2))
    path = robot_path(whole.times[:9_000], whole.poses[:9_000])
    assert path is not None
    drive = record_swept("ring", place.world, path, laser, Turning(), 117)
    found = checked(swept_mcap(half_of(drive), time_increment=0.0, scan_time=0.0)).reading.sweep
    assert found == pytest.approx(PERIOD)


@pytest.mark.parametrize("told", [0.0, -PERIOD])
def test_scans_beside_the_few_in_turns_are_compared_too(told):
    """The robot turns once in two minutes, so that a few of the scans that are spread over the log are
    of a turn."""
    place, laser = building(1, 1, 61), turning(BEAMS, 10.0, 0.015, 0.01)
    way = place.crossings([(0, 0), (1, 0), (1, 1)])
    path = fine_path(way, Drive(speed=0.25, turn_rate=0.8))
    drive = record_swept("ring", place.world, path, laser, Turning(), 3)
    found = checked(swept_mcap(drive, time_increment=told / BEAMS)).reading.sweep
    assert found == pytest.approx(PERIOD, rel=0.05)


def looking_ahead(turn: float, stamp: str = "first", period: float = 0.1) -> SweptRecording:
    """A drive with a laser that sees 180° every `period` s."""
    laser = Laser(181, -np.radians(90), np.radians(1.0), 20.0, noise=0.015, resolution=0.001)
    path = fine_path(office_way()[1:8], Drive(speed=0.6, turn_rate=2.5))
    return record_swept("office", office_world(), path, laser, Turning(period, turn, stamp), 5)


@pytest.mark.parametrize("turn", [0.1, -0.1, 0.0])
def test_a_laser_that_looks_ahead_may_turn_too(turn):
    """Its field of view is that of lasers that see at once, so it was not looked at."""
    found = checked(swept_mcap(looking_ahead(turn), time_increment=0.0)).reading.sweep
    assert found == (pytest.approx(turn) if turn else None)


@pytest.mark.parametrize("stamp", ["first", "middle", "last"])
@pytest.mark.parametrize("hertz", [15, 25])
def test_scans_of_a_fast_laser_are_stamped_at_another_beam(hertz, stamp):
    """Half of its sweep is shorter than what a clock is blamed for; headings were off by 4°."""
    laser = Laser(540, -np.radians(135), np.radians(0.5), 12.0, noise=0.015, resolution=0.001)
    path = fine_path(office_way()[8:16], Drive(speed=0.8, turn_rate=2.5))
    drive = record_swept("office", office_world(), path, laser, Turning(1 / hertz, 1 / hertz, stamp), 5)
    assert checked(swept_mcap(drive)).reading == ReadingOptions(stamp=stamp)


@pytest.mark.parametrize("stamp", ["first", "middle", "last"])
def test_odometry_that_comes_seldom_tells_the_beam_of_the_stamps(stamp):
    """Five poses a second tell it where turns begin and end; headings were off by 3.4°."""
    drive = looking_ahead(0.1, stamp)
    path = robot_path(drive.odometry.times[::4], drive.odometry.poses[::4])
    assert path is not None
    assert checked(swept_mcap(dataclasses.replace(drive, odometry=path))).reading == ReadingOptions(
        stamp=stamp
    )


@pytest.mark.parametrize(("rate", "stamp"), list(itertools.product((0.5, 1.5, 2.8), ("middle", "last"))))
def test_scans_that_are_stamped_at_another_beam_are_read_so(rate, stamp):
    """Their turns are later than those of odometry by half a turn of the laser, or by a whole one."""
    found = checked(swept_mcap(driven(PERIOD, rate, stamp)))
    assert found.reading == ReadingOptions(stamp=stamp)
    (message,) = found.messages
    assert message.startswith(f"scans are stamped at their {stamp} beam")
    right = log_from(swept_mcap(driven(PERIOD, rate, stamp)), "office.mcap", ReadingOptions(stamp=stamp))
    assert found.log.beam_times is not None
    assert right.beam_times is not None
    np.testing.assert_allclose(found.log.beam_times.first, right.beam_times.first)


@pytest.mark.parametrize(("points", "rate"), [(6, 0.5), (6, 2.8), (7, 2.8)])
@pytest.mark.parametrize("stamp", ["first", "middle", "last"])
def test_a_few_turns_are_enough_for_the_beam_of_the_stamps(points, rate, stamp):
    """In 9 to 14 scans the robot turns; its headings were off by 16° without a warning."""
    assert checked(swept_mcap(driven(PERIOD, rate, stamp, points=points))).reading == ReadingOptions(
        stamp=stamp
    )


@pytest.mark.parametrize("reading", [ReadingOptions(as_recorded=True), ReadingOptions(sweep=-PERIOD)])
def test_what_the_user_says_is_not_asked(reading):
    found = checked(recording(PERIOD, 2.8, -PERIOD), reading)
    assert found.messages == []
    assert found.reading == reading
    assert found.log.beam_times is not None
    np.testing.assert_allclose(found.log.beam_times.step, -PERIOD / BEAMS, rtol=1e-4)


@pytest.mark.parametrize("late", [0.14, -0.1, 0.0])
def test_odometry_is_moved_to_where_its_turns_are_those_of_the_scans(late):
    """Turns of the laser are corrected by odometry, which has to be that of their time."""
    drive = driven(PERIOD, 0.5)
    path = robot_path(drive.odometry.times - late, drive.odometry.poses)
    assert path is not None
    found = checked(swept_mcap(dataclasses.replace(drive, odometry=path)))
    assert found.reading.clock_offset == pytest.approx(late, abs=0.03 if late else 0)
    assert [message.split(",")[0] for message in found.messages] == (
        [f"odometry is stamped {abs(found.reading.clock_offset):.2g} s too {'early' if late > 0 else 'late'}"]
        if late
        else []
    )
    assert found.log.odometry is not None
    off = relative(found.log.odometry, poses_at(drive.odometry, found.log.times))
    assert np.nanmax(np.abs(off[:, 2])) < np.radians(1.6)


@pytest.mark.parametrize(("name", "used"), [
    ("field/rplidar-floor", -0.134), ("field/rplidar-hallway.bag", -0.0695),
    ("field/urg-corridor-1.bag", None), ("field/old-index.bag", None),
    ("field/mocap.bag", None), ("strangers/sweep-none.mcap", None), ("strangers/posts.mcap", None),
    ("mit-csail.log.gz", None), ("fr079.log.gz", None), ("field/player-2.1.2.log", None),
])  # fmt: skip
def test_real_lasers(name, used):
    """The driver of the RPLIDAR turns the readings round, as its laser turns clockwise; its times stay."""
    log = read_log(str(data_file(name)))
    found = checked_file(log, ReadingOptions(), FileCheckOptions()).reading.sweep
    assert found is None if used is None else found == pytest.approx(used, abs=2e-4)


def test_the_few_turns_of_half_a_drive_are_all_compared():
    """Pairs that begin with the same few scans end no comparison."""
    log = read_log(str(data_file("field/rplidar-hallway.bag")))
    half = excerpt(log, slice(len(log) // 2, None))
    found = checked_file(half, ReadingOptions(), FileCheckOptions()).reading.sweep
    assert found == pytest.approx(-0.0695, abs=2e-4)


def test_a_laser_that_sees_at_once_is_soon_known():
    """Its other times fit hardly better after some pairs, so that the others are not matched."""
    log, options = read_log(str(data_file("field/mocap.bag"))), FileCheckOptions()
    motion, period = (
        ScanMotion.of_log(log, options.steps, options.sweep),
        float(np.median(np.diff(log.times))),
    )
    evidence = sweep_evidence(motion, (0.0, period, -period, 0.5 * period, -0.5 * period), 0.0, options.sweep)
    assert len(evidence.energies) == options.sweep.least_pairs
