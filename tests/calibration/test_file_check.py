"""What scans contradict of their file: what may be wrong is found, and nothing where all is right."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.odometry_options import ClockOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import are_known, compose
from tests.data import OFFICE_LOG, data_file
from tests.logs.excerpts import excerpt
from tests.simulation import faults, odometry_faults
from tests.slam.keyframe_drives import round_scene

Fault = Callable[[LaserLog], LaserLog]


@functools.cache
def drive() -> LaserLog:
    return round_scene().record(5).log()


@functools.cache
def real_drive() -> LaserLog:
    return read_log(str(data_file("mit-csail.log.gz")))


def found(log: LaserLog, reading: ReadingOptions | None = None) -> list[str]:
    return checked_file(log, reading or ReadingOptions(), FileCheckOptions()).messages


def in_centimetres(log: LaserLog) -> LaserLog:
    """The log as if its readings had been taken for centimetres."""
    return replace(log, report=replace(log.report, used={"range_scale": "0.01"}))


LIKELY: dict[str, tuple[Fault, str]] = {
    "mirrored": (faults.mirrored, "in the wrong order, and the map is mirrored.*try --flip"),
    "looks to the left": (lambda log: faults.mounted_otherwise(log, -np.pi / 2), "90° further to the left"),
    "heads to the left": (
        lambda log: odometry_faults.heading_elsewhere(log, np.pi / 2),
        "headings of odometry are likely 90° too far to the left;.*try --no-odometry; meanwhile",
    ),
    "in the middle, and looks to the left": (
        lambda log: replace(log, mount=np.array([0.0, 0.0, -np.pi / 2])),
        "90° further to the left.*--mount 0,0,0, or --no-odometry if the headings .* too far to the right",
    ),
    "looks back": (
        lambda log: faults.mounted_otherwise(log, np.pi),
        "180° further.*try --mount 0.1,0,0, or --odometry-scale -1 if",
    ),
    "drives backwards": (
        odometry_faults.behind,
        "forward as backward;.*where the file says; try --odometry-scale -1, or --mount 0.1,0,180 if",
    ),
    "is elsewhere": (
        lambda log: replace(log, mount=log.mount + np.array([0.3, -0.2, 0.0])),
        r"by -0\.(29|30|31) m ahead and \+0\.(19|20|21) m to the left.*try --mount 0.(09|1|11),-?0",
    ),
    "turns the wrong way": (
        lambda log: odometry_faults.turning(log, -1.0),
        "try --flip; if left and right are correct in the map, odometry turns the wrong way",
    ),
    "looks askew": (lambda log: faults.mounted_otherwise(log, 0.6), "try --mount 0.1,0,0(, or|$)"),
    "half as long": (lambda log: odometry_faults.scaled(log, 0.5), r"try --odometry-scale (1\.9|2\.0|2)"),
    "a tenth too short, or the ranges too long": (
        lambda log: odometry_faults.scaled(log, 0.9),
        r"odometry is 1\.1\d? m by.*try --odometry-scale 1\.1\d?; if the ranges,.*--range-scale 0\.9",
    ),
    "a tenth too short, and the ranges looked like centimetres": (
        lambda log: in_centimetres(odometry_faults.scaled(log, 0.9)),
        r"if the ranges,.*--range-scale 0\.009",
    ),
    "ranges too short": (
        lambda log: faults.ranges_scaled(log, 0.25, slice(None)),
        r"are likely too short.* so small, or robots so fast; try --range-scale (4\.\d+|4|3\.9\d), or --odom",
    ),
    "another scale from half-way on": (
        lambda log: odometry_faults.scaled_in(log, 1 / 1.2, slice(len(log) // 2, None)),
        r"change their scale from scan \d+ to \d+: one metre .* is (1|0\.9\d+|1\.0\d) m by scans before and "
        r"1\.[12]\d? m .* --end [\d.]+, or --start [\d.]+, with --range-scale 0\.8\d+ .*-scale 1\.[12]\d?",
    ),
    "a third too long": (lambda log: odometry_faults.scaled(log, 1.33), r"try --odometry-scale 0\.7"),
    "turns by half": (
        lambda log: odometry_faults.turning(log, 0.5),
        r"turns by odometry are 0\.5\d? times.*--no-odometry",
    ),
}


@pytest.mark.parametrize("name", LIKELY)
def test_what_is_likely_is_said_with_its_cure_and_left_alone(name):
    make, words = LIKELY[name]
    log = make(drive())
    checked = checked_file(log, ReadingOptions(), FileCheckOptions())
    assert len(checked.messages) == 1
    assert re.search(words, checked.messages[0])
    is_changed = re.search("odometry is (mirrored as well|changed to agree)", checked.messages[0])
    assert (checked.log is log) == (is_changed is None)
    assert checked.reading == ReadingOptions()


def test_turns_that_disagree_tell_no_place_of_the_laser():
    """By a clock that was not found."""
    late = odometry_faults.late(replace(excerpt(real_drive(), slice(900, 1700)), odometry_path=None), 2.0)
    log = odometry_faults.held(late, slice(266, 533), False)
    options = FileCheckOptions(clock=ClockOptions(gain=0.0))
    said = checked_file(log, ReadingOptions(), options).messages
    assert not [each for each in said if "elsewhere on the robot" in each]


def test_what_is_put_right_is_compared_again():
    """In another unit few steps of this log seem to show a laser that looks elsewhere."""
    log = replace(read_log(str(data_file("field/urg-corridor-1.bag"))), beam_times=None, odometry_path=None)
    as_recorded, said = found(log), found(odometry_faults.scaled(log, 100.0))
    assert "--odometry-scale 0.01;" in said[-1]
    assert said[:-1] == as_recorded


SCALES = (1000.0, 10.0, 0.1, 300.0)


@pytest.mark.parametrize("scale", SCALES)
def test_a_scale_beyond_doubt_is_put_right(scale):
    log = odometry_faults.scaled(drive(), scale)
    checked = checked_file(log, ReadingOptions(), FileCheckOptions())
    recorded = drive().odometry
    assert recorded is not None
    assert checked.log.odometry is not None
    assert checked.reading.odometry_scale * scale == pytest.approx(1.0, abs=0.02)
    np.testing.assert_allclose(checked.log.odometry, recorded, rtol=0.02, atol=1e-6)
    (message,) = checked.messages
    assert f"as by --odometry-scale {checked.reading.odometry_scale:g}; --as-recorded" in message


def frozen(log: LaserLog) -> LaserLog:
    return odometry_faults.scaled(odometry_faults.turning(log, 0.0), 0.0)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (frozen, "odometry never moves, but the scans do in"),
        (odometry_faults.x_reversed, "odometry counts x or y the wrong way"),
        (lambda log: odometry_faults.scaled(log, 0.0), "the position by odometry never moves"),
        (
            lambda log: odometry_faults.turning(log, 180.0 / np.pi),
            "odometry contradicts the scans: no scale and no clock explains its turns",
        ),
    ],
)
def test_odometry_of_no_use_is_not_used(make, words):
    checked = checked_file(make(drive()), ReadingOptions(), FileCheckOptions())
    assert checked.log.odometry is None
    assert not checked.reading.odometry
    (message,) = checked.messages
    assert message.startswith(words)


def central(log: LaserLog) -> LaserLog:
    """The drive with its laser in the middle of the robot."""
    assert log.odometry is not None
    return replace(log, odometry=compose(log.odometry, log.mount), mount=np.zeros(3))


def test_a_robot_with_its_laser_in_the_middle_mostly_drives_forward():
    (looks,) = found(faults.mounted_otherwise(central(drive()), np.pi))
    assert re.search(r"180° further.*100% of the steps by odometry go forward; try --mount 0,0,-?0", looks)
    (counts,) = found(odometry_faults.behind(central(drive())))
    assert re.search("forward as backward;.* 0% of the steps.*; try --odometry-scale -1, or --mount", counts)


def test_what_goes_along_is_not_looked_for_with_a_wrong_mounting():
    assert not checked_file(drive(), ReadingOptions(as_recorded=True), FileCheckOptions()).companions_checked
    for make in (faults.mirrored, odometry_faults.behind):
        log = make(drive())
        looked = checked_file(log, ReadingOptions(), FileCheckOptions()).companions_checked
        assert looked == (make is odometry_faults.behind)
    looks_back = faults.mounted_otherwise(drive(), np.pi)
    assert checked_file(looks_back, ReadingOptions(), FileCheckOptions()).companions_checked


def test_where_odometry_stands_it_says_nothing_of_the_mounting_elsewhere():
    rows = slice(len(drive()) // 3, len(drive()) // 2)
    held = odometry_faults.held(faults.mounted_otherwise(drive(), -np.pi / 2), rows, True)
    stands, looks = found(held)
    assert stands.startswith("odometry stands still")
    assert "90° further to the left" in looks


@pytest.mark.parametrize("catches_up", [True, False])
@pytest.mark.parametrize("log", [drive, real_drive])
def test_odometry_that_stands_for_a_part_is_missing_there(log, catches_up):
    whole = log()
    rows = slice(len(whole) // 3, len(whole) // 2)
    held = odometry_faults.held(whole, rows, catches_up)
    checked = checked_file(held, ReadingOptions(), FileCheckOptions())
    assert checked.messages[0].startswith("odometry stands still while the scans move, from scan ")
    assert checked.log.odometry is not None
    unknown = np.flatnonzero(~are_known(checked.log.odometry))
    assert abs(len(unknown) - (rows.stop - rows.start)) < 25
    assert checked.reading == ReadingOptions()
    assert found(held, ReadingOptions(as_recorded=True)) == []


@pytest.mark.parametrize(
    ("name", "first", "last"), [("field/urg-corridor-1.bag", 256, 512), ("intel.log.gz", 6815, None)]
)
def test_odometry_that_stands_is_found_though_the_robot_stood_at_times(name, first, last):
    log = replace(read_log(str(data_file(name))), odometry_path=None)
    held = odometry_faults.held(log, slice(first, last), False)
    said = found(held)
    assert [text for text in said if "as it is" in text] == said
    assert re.match(rf"odometry stands still .* move, from scan ({first - 1}|{first}) to ", said[-1])


def test_positions_without_headings_are_not_used():
    """Some drivers write positions only."""
    log = real_drive()
    assert log.odometry is not None
    (said,) = found(replace(log, odometry=log.odometry * (1.0, 1.0, 0.0)))
    assert said.startswith(
        "odometry contradicts the scans: no scale, mounting or clock explains its positions"
    )


@pytest.mark.parametrize("make", [frozen, faults.mirrored, lambda log: odometry_faults.scaled(log, 1000.0)])
def test_as_recorded_believes_the_file(make):
    log, reading = make(drive()), ReadingOptions(as_recorded=True)
    checked = checked_file(log, reading, FileCheckOptions())
    assert (checked.log, checked.reading, checked.messages) == (log, reading, [])


@pytest.mark.parametrize("make", [case[0] for case in LIKELY.values()], ids=list(LIKELY))
def test_a_real_log_tells_the_same(make):
    """Its odometry turns by 1.14 of what the scans do, with a spread of a quarter."""
    said = found(make(real_drive()))
    assert len(said) <= 1
    if "turns" not in str(said):
        assert len(said) == 1


def test_ranges_in_feet_are_no_odometry_in_another_unit():
    """The map has the right shape meanwhile, and the ranges are what the owner has to change."""
    log = drive()
    checked = checked_file(replace(log, ranges=log.ranges / 0.3048), ReadingOptions(), FileCheckOptions())
    (message,) = checked.messages
    assert re.search(
        r"^the ranges are likely in feet: one metre by odometry is 3\.\d+ m.* 0\.3048; as", message
    )
    assert checked.reading.odometry_scale == pytest.approx(1 / 0.3048, rel=0.02)


def test_odometry_that_is_converted_to_metres_twice_is_no_range_in_feet():
    """Rooms and speed are as expected once it is multiplied, so the map is not said to be in feet."""
    log = odometry_faults.scaled(read_log(OFFICE_LOG), 0.3048)
    checked = checked_file(log, ReadingOptions(), FileCheckOptions())
    (message,) = checked.messages
    assert re.search(r"^one metre by odometry is 3\.\d+ m.* as by --odometry-scale 3\.\d+; if the", message)
    assert "if the ranges are in feet instead, and the map is too large, --range-scale 0.3048" in message


def test_scans_that_stay_the_same_while_the_robot_drives():
    """The laser sees what goes along with the robot: odometry is not blamed for it."""
    log = drive()
    seen = log.ranges[:1] + np.random.default_rng(1).normal(0.0, 0.01, log.ranges.shape)
    checked = checked_file(replace(log, ranges=seen.astype(np.float32)), ReadingOptions(), FileCheckOptions())
    assert any("the scans stay the same while the robot drives" in each for each in checked.messages)
    assert checked.log.odometry is not None


def test_a_wrong_sign_where_the_robot_mostly_drives_along_one_axis():
    """A laser that looks aside explained three quarters of the steps, and nothing was said."""
    log = excerpt(read_log(str(data_file("intel.log.gz"))), slice(6000, 9000))
    assert log.odometry is not None
    assert found(log) == []
    for wrong in (log.odometry * (1, -1, 1), log.odometry[:, [1, 0, 2]]):
        assert any("counts x or y the wrong way" in said for said in found(replace(log, odometry=wrong)))


def test_turns_that_are_wrong_in_the_mean_where_scans_tell_single_ones_badly():
    log = excerpt(read_log(str(data_file("fr-campus.log.gz"))), slice(0, 1000))
    assert found(log) == []
    (said,) = found(odometry_faults.turning(log, 2.0))
    assert re.match(r"odometry likely turns wrongly: turns by odometry are 2\.\d+ times", said)
