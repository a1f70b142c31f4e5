"""A laser that is turned, or whose readings come in the other order, from a scan on."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.odometry_options import ViewChangeOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.range_jump_options import OrderJumpOptions
from nscan_cli.calibration.view_change import direction_change, turn_change
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import MIRRORED, Array, compose, relative
from tests.calibration.test_file_check import drive, real_drive
from tests.data import data_file
from tests.simulation import faults
from tests.simulation.laser import Laser
from tests.simulation.scenes import office

OPTIONS = ViewChangeOptions()
MOUNT = np.array([0.3, -0.1, 0.7])


def steps(seed: int, count: int = 60) -> tuple[Array, Array]:
    """Steps (n, 3) of laser and odometry with some noise."""
    rng = np.random.default_rng(seed)
    robot = np.stack([rng.uniform(0.1, 0.3, count), np.zeros(count), rng.normal(0.0, 0.1, count)], axis=1)
    laser = relative(compose(robot, MOUNT), MOUNT) + rng.normal(0.0, 0.01, (count, 3))
    return laser, robot


@pytest.mark.parametrize(("turn", "at"), [(0.3, 30), (-1.5, 20), (3.1, 45)])
def test_the_place_and_both_directions_are_found(turn, at):
    laser, odometry = steps(1)
    laser[at:] = relative(compose(laser[at:], np.zeros(3)), np.array([0.0, 0.0, turn]))
    laser[at:, 2] = steps(1)[0][at:, 2]
    found = direction_change(laser, odometry, MOUNT, OPTIONS.min_steps, OPTIONS)
    assert found is not None
    assert abs(found.step - at) <= 1
    assert found.before == pytest.approx(MOUNT[2], abs=OPTIONS.min_direction)
    assert np.cos(found.behind - found.before - turn) > 0.999
    assert found.exceeds(OPTIONS.min_direction, OPTIONS.sigmas)


def test_turns_of_mirrored_scans_are_opposite():
    laser, odometry = steps(2)
    laser[40:] *= MIRRORED
    found = turn_change(laser, odometry, OPTIONS.min_steps, OPTIONS)
    assert found is not None
    assert found.is_order
    assert abs(found.step - 40) <= 2
    assert found.before == pytest.approx(1.0, abs=0.1)
    assert found.behind == pytest.approx(-1.0, abs=0.1)


@pytest.mark.parametrize("scale", [1.0, 1000.0, 0.01])
def test_noise_is_no_change(scale):
    """Also where odometry is in another unit than the mounting."""
    for seed in range(200):
        laser, odometry = steps(seed)
        odometry[:, :2] *= scale
        found = direction_change(laser, odometry, MOUNT, OPTIONS.min_steps, OPTIONS)
        assert found is not None
        assert not found.exceeds(OPTIONS.min_direction, OPTIONS.sigmas)
        turned = turn_change(laser, odometry, OPTIONS.min_steps, OPTIONS)
        assert turned is None or not turned.is_order


def test_few_steps_tell_none():
    laser, odometry = steps(3, count=15)
    assert direction_change(laser, odometry, MOUNT, OPTIONS.min_steps, OPTIONS) is None
    assert turn_change(laser, odometry, OPTIONS.min_steps, OPTIONS) is None


def said_of(log: LaserLog) -> list[str]:
    """What steps show; scans beside each other would show another order before."""
    options = FileCheckOptions(order=OrderJumpOptions(max_candidates=0))
    return checked_file(log, ReadingOptions(), options).messages


@pytest.mark.parametrize("share", [0.5, 0.8])
def test_the_scan_from_which_readings_are_reversed_is_named(share):
    whole = real_drive()
    at = int(share * len(whole))
    (said,) = said_of(faults.mirrored_in(whole, slice(at, None)))
    words = r"order of the readings likely changes from scan (\d+) to (\d+): "
    named = re.search(words + r".* try --end [\d.]+, or --start \S+ --flip", said)
    assert named is not None
    assert int(named[1]) - 60 <= at <= int(named[2]) + 60
    (said,) = said_of(faults.mirrored_in(whole, slice(0, at)))
    assert re.search(r"try --end [\d.]+ --flip, or --start [\d.]+;", said)


@pytest.mark.parametrize("degrees", [90, 180])
def test_a_round_laser_that_is_turned_is_no_robot_that_reverses(degrees: int):
    """Seen from behind, the robot goes back; the odometry of that half would be reversed."""
    round_laser = Laser(360, -np.pi, np.radians(1.0), 12.0, no_return=13.0, mount=(0.2, 0.0, 0.0))
    whole = office().record_at(office().truth()[:700], 5, round_laser).log()
    (said,) = said_of(faults.turned_in(whole, np.radians(degrees), slice(len(whole) // 2, None)))
    assert f"the laser looks {degrees}°" in said


@pytest.mark.parametrize("degrees", [45, 90])
def test_a_laser_that_is_turned_for_a_while_is_named_with_both_places(degrees: int):
    """Its map is 3 m off, and no change at one place explains the steps."""
    round_laser = Laser(360, -np.pi, np.radians(1.0), 12.0, no_return=13.0, mount=(0.2, 0.0, 0.0))
    whole = office().record_at(office().truth()[250:850], 11, round_laser).log()
    turned = faults.turned_in(whole, np.radians(degrees), slice(200, 400))
    (said,) = said_of(turned)
    words = rf"looks {degrees}° .* scan (\d+) to (\d+) on until one from (\d+) to (\d+) than elsewhere"
    named = re.search(words, said)
    assert named is not None
    before, behind, last, again = map(int, named.groups())
    assert before <= 200 <= behind
    assert last <= 400 <= again
    assert re.search(
        rf"try --end [\d.]+, or --start [\d.]+ --end [\d.]+ --mount 0.2,0,-{degrees}, or --st", said
    )
    one = FileCheckOptions(view=replace(OPTIONS, min_left=1.0))
    assert not any("than elsewhere" in text for text in checked_file(turned, ReadingOptions(), one).messages)


@pytest.mark.parametrize("degrees", [30, 90, 180])
@pytest.mark.parametrize("log", [drive, real_drive])
def test_the_scan_from_which_the_laser_looks_elsewhere_is_named(log, degrees):
    whole = log()
    at = len(whole) // 2
    (said,) = said_of(faults.turned_in(whole, np.radians(degrees), slice(at, None)))
    words = (
        rf"looks ({degrees}|{degrees + 1})° further .* from scan (\d+) to (\d+) .* --mount \S+,-?{degrees}$"
    )
    named = re.search(words, said)
    assert named is not None
    assert int(named[2]) - 60 <= at <= int(named[3]) + 60


@pytest.mark.parametrize("log", [drive, real_drive])
def test_a_laser_that_was_knocked_is_named(log):
    """Its map is 0.01 m off, in silence otherwise."""
    whole = log()
    turned = faults.turned_in(whole, np.radians(5.0), slice(len(whole) // 2, None))
    (said,) = said_of(turned)
    assert re.search(r"looks [56]° further to the right behind a place", said)
    coarse = FileCheckOptions(view=replace(OPTIONS, min_direction=0.2))
    assert not any(
        "behind a place" in text for text in checked_file(turned, ReadingOptions(), coarse).messages
    )


def test_options_decide():
    log = faults.mirrored_in(real_drive(), slice(len(real_drive()) // 2, None))
    few = FileCheckOptions(view=replace(OPTIONS, min_steps=10_000))
    said = checked_file(log, ReadingOptions(), few).messages
    assert not any("order of the readings" in text for text in said)


@pytest.mark.parametrize("name", ["intel", "fr079", "mit-killian", "fr-campus", "fr-clinic"])
def test_no_real_log_changes_its_view(name):
    said = said_of(read_log(str(data_file(f"{name}.log.gz"))))
    assert not any(re.search("the order of|behind a place|than elsewhere", text) for text in said)
