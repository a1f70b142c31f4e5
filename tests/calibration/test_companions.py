"""What goes along with the robot: found on its path, left out, and nothing of the kind where nothing is."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.companion_options import CompanionOptions
from nscan_cli.calibration.companions import find_companion
from nscan_cli.calibration.contradictions import find_contradictions
from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.unsigned_odometry import checked_signs
from nscan_cli.logs.beam_mask import mask_beams
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions, sectors_from
from nscan_cli.poses import wrap
from nscan_cli.slam.diagnostics.notices import notices
from tests.data import OFFICE_LOG, data_file
from tests.logs.excerpts import excerpt, truth_of
from tests.simulation import faults, odometry_faults, things_beside
from tests.simulation.laser import Laser
from tests.simulation.scenes import office
from tests.slam.mapped_logs import mapped, position_rmse

REAL = ("intel", "fr079", "mit-csail", "mit-killian")
UNTOUCHED = 0.0025
"""m: error of the drive with nothing behind it."""


@functools.cache
def drive() -> LaserLog:
    scene, laser = office(), Laser(360, -np.pi, np.radians(1.0), 12.0, no_return=13.0, mount=(0.2, 0.0, 0.0))
    return scene.record_at(scene.truth()[:600], 7, laser).log()


COMPANIONS: dict[str, Callable[[LaserLog], LaserLog]] = {
    "follower": lambda log: things_beside.follower(log, 0.6),
    "close follower": lambda log: things_beside.follower(log, 0.4),
    "leader": lambda log: things_beside.leader(log, 0.8),
    "cart": things_beside.cart,
}


@pytest.mark.parametrize("name", COMPANIONS)
def test_it_is_left_out_and_the_map_is_right(name):
    log = COMPANIONS[name](drive())
    checked = checked_file(log, ReadingOptions(), FileCheckOptions())
    (message,) = checked.messages
    assert message.startswith("something goes along with the robot: in ")
    (sector,) = checked.reading.mask or ()
    middle = wrap(sector[0] + 0.5 * ((sector[1] - sector[0]) % (2 * np.pi)))
    assert abs(wrap(middle - (0.0 if name == "leader" else np.pi))) < 0.25
    is_its, is_left = log.ranges < drive().ranges, ~np.isnan(checked.log.ranges)
    assert np.count_nonzero(is_its & is_left) < 0.06 * np.count_nonzero(is_its)
    # What is seen beside it and beyond where it is stays, but for walls as near.
    assert np.count_nonzero(~is_its & ~is_left) < 0.03 * is_its.size
    assert checked.log.odometry is log.odometry
    assert checked_file(log, ReadingOptions(as_recorded=True), FileCheckOptions()).log is log


@pytest.mark.parametrize("name", COMPANIONS)
def test_the_message_has_the_option_that_does_the_same(name):
    log = COMPANIONS[name](drive())
    checked = checked_file(log, ReadingOptions(), FileCheckOptions())
    (said,) = checked.messages
    ranges, mask = log.ranges.copy(), sectors_from(said.partition("--mask ")[2].partition(";")[0])
    mask_beams(ranges, log.angle_min, log.angle_increment, mask)
    np.testing.assert_array_equal(ranges, checked.log.ranges)
    np.testing.assert_allclose(mask, checked.reading.mask or (), atol=1e-9)


@pytest.mark.parametrize(
    "fault",
    [
        functools.partial(things_beside.follower, distance=0.4),
        functools.partial(things_beside.cart, hitch=0.25),
    ],
)
def test_the_map_is_right_without_it(fault):
    """A cart on a short bar covers the laser where the robot turns on the spot."""
    log = fault(drive())
    found = mapped(checked_file(log, ReadingOptions(), FileCheckOptions()).log)
    assert position_rmse(found.graph.poses, truth_of(log)) < UNTOUCHED + 0.002
    assert not found.state.breaks


def test_a_cart_that_swings_round_the_laser_is_left_out_all_around():
    log = things_beside.cart(drive(), hitch=0.3, length=0.6, width=0.6)
    mask = checked_file(log, ReadingOptions(), FileCheckOptions()).reading.mask or ()
    (reach,) = (sector[2] for sector in mask if sector[:2] == (-np.pi, np.pi))
    assert 0.6 < reach < 0.9
    seldom = FileCheckOptions(companion=replace(CompanionOptions(), min_covered=100))
    assert len(checked_file(log, ReadingOptions(), seldom).reading.mask or ()) == len(mask) - 1


def test_a_long_cart_that_swings_through_all_bearings_is_in_one_place():
    """Of the bearings in which scans see it, fewer than two thirds are in one quarter."""
    log = things_beside.cart(drive(), hitch=0.4, length=1.0)
    assert log.odometry is not None
    assert find_companion(log, log.odometry, CompanionOptions()) is not None


ELSEWHERE: dict[str, tuple[Callable[[LaserLog], LaserLog], str]] = {
    "in millimetres": (
        lambda log: odometry_faults.scaled(log, 1000.0),
        "as by --odometry-scale 0.001",
    ),
    "by a laser that looks aside": (
        lambda log: faults.mounted_otherwise(log, np.pi / 2),
        "try --mount -0.04,0,0",
    ),
    "by a laser that looks back": (lambda log: faults.mounted_otherwise(log, np.pi), "try --mount -0.04,0,0"),
    "with readings in the wrong order": (faults.mirrored, "try --flip"),
}


@pytest.mark.parametrize("name", ELSEWHERE)
def test_it_is_found_though_odometry_as_recorded_leads_elsewhere(name):
    make, words = ELSEWHERE[name]
    log = read_log(str(data_file("fr079.log.gz")))
    log = replace(things_beside.leader(excerpt(log, slice(2800, 4000)), 0.6), beam_times=None)
    checked = checked_file(make(log), ReadingOptions(), FileCheckOptions())
    finding, said = checked.messages[-2:]
    assert words in finding
    assert "something goes along with the robot" in said
    (sector,) = checked.reading.mask or ()
    assert -0.9 < sector[0] < -0.4 < 0.4 < sector[1] < 0.9


def test_without_odometry_the_option_is_named():
    log = replace(things_beside.follower(drive(), 0.6), odometry=None, odometry_path=None)
    assert checked_file(log, ReadingOptions(), FileCheckOptions()).messages == []
    (said,) = (each for each in notices(mapped(log).state) if "goes along" in each)
    assert "; try --mask 1" in said


def test_it_is_looked_for_once():
    """Before the log is mapped where odometry tells the path and is not in doubt, else afterwards."""
    log, options = drive(), FileCheckOptions()
    assert checked_file(log, ReadingOptions(), options).companions_checked
    without = odometry_faults.missing(log, slice(100, 110))
    for other in (without, faults.mirrored(log), replace(log, odometry=None, odometry_path=None)):
        assert not checked_file(other, ReadingOptions(), options).companions_checked
    assert not checked_file(log, ReadingOptions(as_recorded=True), options).companions_checked


def test_sectors_that_are_left_out_already_stay_so():
    masked = things_beside.cart(drive())
    report = replace(masked.report, masked=((0.5, 0.6),))
    checked = checked_file(replace(masked, report=report), ReadingOptions(), FileCheckOptions())
    assert checked.reading.mask is not None
    assert checked.reading.mask[0] == (0.5, 0.6)
    assert "--mask 28.6:34.4," in checked.messages[0]
    assert "@" in checked.messages[0].partition("--mask 28.6:34.4,")[2]


@pytest.mark.parametrize("name", REAL)
def test_somebody_who_leads_is_seen_on_real_logs_and_nobody_else(name):
    """Readings on the path are in 63 to 97 % of the scans, and in 5 % at most without anybody."""
    log = read_log(str(data_file(f"{name}.log.gz")))
    assert log.odometry is not None
    assert find_companion(log, log.odometry, replace(CompanionOptions(), min_share=0.1)) is None
    found = find_companion(things_beside.leader(log, 0.8), log.odometry, CompanionOptions())
    assert found is not None
    assert found.share > 0.5


def test_odometry_is_not_blamed_for_somebody_who_leads():
    """Scans of half a turn match best with who is near."""
    log = things_beside.leader(read_log(str(data_file("mit-csail.log.gz"))), 0.6)
    checked = checked_file(log, ReadingOptions(), FileCheckOptions())
    (message,) = checked.messages
    assert message.startswith("something goes along with the robot")
    assert checked.log.odometry is log.odometry
    assert checked.companions_checked


def test_nor_if_he_is_so_near_that_most_steps_by_scans_are_his():
    """They contradict odometry, which agrees with the scans without his beams."""
    log = things_beside.leader(read_log(str(OFFICE_LOG)), 0.4)
    checked = checked_file(log, ReadingOptions(), FileCheckOptions())
    (message,) = checked.messages
    assert message.startswith("something goes along with the robot")
    assert checked.log.odometry is log.odometry
    assert find_contradictions(log, ReadingOptions(), FileCheckOptions(), {})


def test_nor_are_its_signs_or_a_tilted_laser():
    """Someone ahead stays there, as the floor ahead does, and falls back, as if the robot reversed."""
    whole = read_log(str(data_file("mit-killian.log.gz")))
    log, options = things_beside.leader(faults.taken(whole, slice(3500, 7000)), 0.6), FileCheckOptions()
    assert checked_signs(log, options.unsigned, options.steps)[1]
    assert "the scans stay the same" in find_contradictions(log, ReadingOptions(), options)[0].message
    checked = checked_file(log, ReadingOptions(), options)
    (message,) = checked.messages
    assert message.startswith("something goes along with the robot")
    assert checked.log.odometry is log.odometry
    near = np.isnan(checked.log.ranges).sum() - np.isnan(log.ranges).sum()
    assert near < 1.1 * np.count_nonzero(log.ranges < faults.taken(whole, slice(3500, 7000)).ranges)


def test_odometry_that_is_wrong_is_not_believed_for_somebody_who_leads():
    log = faults.mirrored(things_beside.leader(read_log(str(OFFICE_LOG)), 0.6))
    messages = checked_file(log, ReadingOptions(), FileCheckOptions()).messages
    assert not messages[0].startswith("something goes along")


def test_dust_is_everywhere():
    """Single readings at 0.1 m are on the path, but in no direction more than in others."""
    log = faults.dust(drive(), 0.15, 0.1)
    assert checked_file(log, ReadingOptions(), FileCheckOptions()).messages == []
    anywhere = replace(CompanionOptions(), min_quarter_share=0.0)
    assert log.odometry is not None
    assert find_companion(log, log.odometry, anywhere) is not None


def test_walls_beside_a_heading_that_drifts_are_nobody():
    """A laser of half a turn sees them in most of what it sees."""
    log = read_log(str(data_file("mit-csail.log.gz")))
    assert log.odometry is not None
    odometry = log.odometry.copy()
    odometry[:, 2] = wrap(odometry[:, 2] + np.radians(1.0) * (log.times - log.times[0]))
    assert find_companion(log, odometry, CompanionOptions()) is None
    anywhere = replace(CompanionOptions(), min_quarter_share=0.0)
    assert find_companion(log, odometry, anywhere) is not None


def test_a_robot_that_hardly_moves_has_no_path():
    log = faults.taken(things_beside.cart(drive()), slice(0, 10))
    assert log.odometry is not None
    assert find_companion(log, log.odometry, CompanionOptions()) is None
