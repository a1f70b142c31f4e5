"""CARMEN records, line by line; what is expected is derived beside each."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.logs.reading_options import ReadingOptions
from tests.logs.lines import flaser, read

INF = np.inf


def f32(values) -> np.ndarray:
    return np.array(values, dtype=np.float32)


def test_flaser(tmp_path):
    # The robot looks along +y at (1, 2); its laser is 0.2 m ahead of it: at (1, 2.2).
    half = math.pi / 2
    log = read(
        tmp_path,
        "# a comment",
        flaser(100.25, (1.5, 81.91, 2.5), (1, 2.2, half), (1, 2, half)),
        flaser(100.5, (1.25, 0, 2.75), (1, 2.3, half), (1, 2.1, half)),
    )
    assert (log.format, log.laser, log.stamps) == ("CARMEN", "FLASER", ("100.250000", "100.500000"))
    np.testing.assert_array_equal(log.ranges, f32([[1.5, INF, 2.5], [1.25, np.nan, 2.75]]))
    assert log.ranges.dtype == np.float32
    np.testing.assert_allclose(log.mount, (0.2, 0, 0), atol=1e-6)
    assert log.odometry is not None
    np.testing.assert_allclose(log.odometry, [[1, 2, half], [1, 2.1, half]])
    assert log.no_return == pytest.approx(81.91)
    assert log.range_limits == (0.0, 80.0)
    assert log.report.records == {"FLASER": 2}
    # Three beams over 180°: −90°, 0°, 90°. The first end point is 1.5 m to the right of the laser.
    np.testing.assert_allclose(log.points(0), [[0.2, -1.5], [0.2, 2.5]], atol=1e-6)


def test_beams_of_differing_number(tmp_path):
    log = read(tmp_path, flaser(1, (1, 2, 3)), flaser(2, (1, 2)))
    np.testing.assert_array_equal(log.ranges, f32([[1, 2, 3], [1, 2, np.nan]]))
    np.testing.assert_allclose(np.degrees(log.angle_increment), [90, 180])


def test_flaser_without_trailer_gets_a_nominal_time(tmp_path):
    log = read(tmp_path, "FLASER 2 1 2 0 0 0 0 0 0", "FLASER 2 1 2 1 0 0 1 0 0")
    assert log.stamps == ("0.000000", "0.100000")
    assert "file order" in log.report.warnings[0]


@pytest.mark.parametrize("blank", ["\t", "   "])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_blanks_and_line_ends_do_not_matter(tmp_path, blank, end):
    path = tmp_path / "a.log"
    path.write_bytes((flaser(1) + end + "  " + flaser(2).replace(" ", blank) + end).encode())
    from nscan_cli.logs.load import read_log

    log = read_log(str(path))
    np.testing.assert_array_equal(log.ranges, f32([[1, 2, 3]] * 2))


def test_new_messages_carry_their_angles(tmp_path):
    # type, start −0.5, fov 1, resolution 0.5, maximum 5, accuracy, mode; 3 ranges; 2 remissions;
    # laser 0.3 m behind and turned by 180°; robot; tv rv, safety distances, turn axis.
    line = "ROBOTLASER1 0 -0.5 1.0 0.5 5.0 0.01 0 3 1 2 6 2 7 8 0.7 0 3.141593 1 0 0 0.1 0 1 1 1e6 {} h 0"
    log = read(tmp_path, line.format(1), line.format(2))
    assert log.laser == "ROBOTLASER1"
    np.testing.assert_allclose(log.angle_min, -0.5)
    np.testing.assert_allclose(log.angle_increment, 0.5)
    np.testing.assert_array_equal(log.ranges[0], f32([1, 2, INF]))
    assert log.range_limits == (0.0, 5.0)
    np.testing.assert_allclose(log.mount[:2], (-0.3, 0), atol=1e-6)
    assert math.cos(log.mount[2]) == pytest.approx(-1)
    assert log.odometry is not None
    np.testing.assert_allclose(log.odometry, [[1, 0, 0]] * 2)


def test_the_front_laser_is_preferred_and_the_others_named(tmp_path):
    lines = [flaser(1, tag="RLASER"), flaser(1.1), flaser(2, tag="RLASER"), "LASER3 1 1 1.0 h 0"]
    log = read(tmp_path, *lines)
    assert (log.laser, len(log)) == ("FLASER", 1)
    assert "RLASER (2), LASER3 (1)" in log.report.warnings[0]
    assert read(tmp_path, *lines, options=ReadingOptions(laser="RLASER")).laser == "RLASER"
    with pytest.raises(WrongUsageError, match=r"RAWLASER1.*FLASER, RLASER, LASER3"):
        read(tmp_path, *lines, options=ReadingOptions(laser="RAWLASER1"))


def test_options_for_angles_mount_and_flip(tmp_path):
    options = ReadingOptions(angle_min=-0.25, angle_increment=0.125, mount=(1, 2, 3), flip=True)
    log = read(tmp_path, flaser(1, laser=(9, 9, 9), robot=(1, 1, 1)), options=options)
    assert (log.angle_min[0], log.angle_increment[0]) == (0.25, -0.125)
    assert log.mount.tolist() == [1, 2, 3]


def test_range_options(tmp_path):
    options = ReadingOptions(min_range=1.0, max_range=2.5)
    log = read(tmp_path, flaser(1, (0.5, 1.0, 1.5, 2.5, 81.91)), options=options)
    np.testing.assert_array_equal(log.ranges[0], f32([np.nan, np.nan, 1.5, INF, INF]))
    assert log.range_limits == (1.0, 2.5)
    assert log.no_return == pytest.approx(81.91)


def test_the_maximum_of_param_holds(tmp_path):
    log = read(tmp_path, "PARAM robot_front_laser_max 2.5 nohost 0", flaser(1))
    np.testing.assert_array_equal(log.ranges[0], f32([1, 2, INF]))


def test_sorted_with_everything_that_belongs_to_a_scan(tmp_path):
    log = read(
        tmp_path, flaser(3, (3, 9), (3, 0, 0)), flaser(1, (1,), (1, 0, 0)), flaser(2, (2, 9), (2, 0, 0))
    )
    assert log.ranges[:, 0].tolist() == [1, 2, 3]
    assert log.odometry is not None
    assert log.odometry[:, 0].tolist() == [1, 2, 3]
    assert math.degrees(log.angle_min[0]) == -90
    assert log.report.backward_stamps == 1


def test_numbers_are_those_of_the_whole_log(tmp_path):
    lines = [flaser(time, (1 + time, 2), (time, 0, 0)) for time in (5, 4, 3, 2, 1, 0)]
    log = read(tmp_path, *lines, options=ReadingOptions(start=1, end=5, every=2))
    assert log.numbers.tolist() == [1, 3, 5]
    assert log.times.tolist() == [1, 3, 5]
    assert log.ranges[:, 0].tolist() == [2, 4, 6]
    assert log.odometry is not None
    assert log.odometry[:, 0].tolist() == [1, 3, 5]
    assert log.row(3) == 1
    with pytest.raises(WrongUsageError, match="no scan 2"):
        log.row(2)


def test_nothing_but_malformed_records(tmp_path):
    with pytest.raises(InputDataError, match=r"line 1: no FLASER record can be read: wrong number of values"):
        read(tmp_path, "FLASER 3 1 2")


def test_no_laser(tmp_path):
    with pytest.raises(InputDataError, match="no laser scans, only PARAM, ODOM"):
        read(tmp_path, "PARAM a 1 nohost 0", "ODOM 0 0 0 0 0 0 1 h 0")


def test_records_of_unknown_kinds_are_told(tmp_path):
    log = read(tmp_path, flaser(1), flaser(2).replace("FLASER", "FLASEQ"), flaser(3), "SONAR 1 2 3 h 4")
    assert len(log) == 2
    assert log.report.warnings[0] == "1 record of kinds unknown to CARMEN: FLASEQ (1)"


def test_where_no_time_was_measured_the_loggers_holds(tmp_path):
    """PARAM and SYNC have absolute times there, all others seconds since the logger's start."""

    def at(line: str, logged: float) -> str:
        return f"{line.rsplit(' ', 3)[0]} 0 nohost {logged}"

    log = read(
        tmp_path,
        "PARAM robot_width 1 nohost 1096466466.5",
        "SYNC some 1096466466.9 nohost 1096466466.9",
        at("ODOM 0 0 0 0 0 0 0 h 0", 1.0),
        at("RAWLASER1 0 -1.57 3.14 1.57 80 0.01 0 3 1 2 3 0 0 h 0", 1.25),
        at("RAWLASER1 0 -1.57 3.14 1.57 80 0.01 0 3 1 2 3 0 0 h 0", 1.75),
        at("ODOM 4 0 0 0 0 0 0 h 0", 2.0),
        at("TRUEPOS 7 0 0 0 0 0 0 h 0", 1.5),
    )
    assert log.stamps == ("1.25", "1.75")
    assert log.odometry is not None
    np.testing.assert_allclose(log.odometry[:, 0], [1.0, 3.0])
    assert log.truth_times is not None
    assert log.truth_times.tolist() == [1.5]
    assert "the scans' own time stamps are unusable: the logger's are used" in log.report.warnings


def test_times_of_the_logger_that_say_nothing_either(tmp_path):
    log = read(tmp_path, flaser("0"), flaser("0"), flaser("0"))
    assert log.stamps == ("0.000000", "0.100000", "0.200000")
    assert "file order" in log.report.warnings[0]
    # Without a trailer there is no time of a logger.
    log = read(tmp_path, "FLASER 2 1 2 0 0 0 0 0 0.5", "FLASER 2 1 2 0 0 0 0 0 0.7")
    assert log.stamps == ("0.000000", "0.100000")
