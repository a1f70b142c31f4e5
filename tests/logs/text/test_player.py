"""Player text, versions 1 and 2: golden lines as writelog.cc prints them, and the arrays that they mean."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from tests.logs.lines import read

V1 = [
    "## Player version 1.4rc2 ",
    "## File version 0.2.0",
    "## Format: ",
    "1067381970.022 gates1 6665 sync 00 1067381970.022 ",
    "1067381970.100 gates1 6665 position 00 1067381970.000 +01.000 +00.500 +0.100 +00.100 +00.000 +00.000 0",
    # The server's time is later than the data's.
    "1067381970.130 gates1 6665 laser 00 1067381970.050 -1.5708 +1.5708 +0.7854 0005 "
    "1.000  0 2.000  1 3.000  0 8.191  0 0.000  0 ",
    "1067381970.200 gates1 6665 position 00 1067381970.100 +01.200 +00.500 +0.300 +00.100 +00.000 +00.000 0",
    "1067381970.230 gates1 6665 laser 00 1067381970.075 -1.5708 +1.5708 +0.7854 0005 "
    "1.500  0 2.500  1 3.500  0 4.500  0 5.500  0 ",
]

V2 = [
    "## Player version 2.0.4",
    "## File version 0.3.0",
    "0000000001.000 16777343 6665 laser 00 004 001  +0.180  -0.020   0.100   0.150   0.150",
    "0000000002.000 16777343 6665 position2d 00 001 001 +01.000 +02.000 +03.100 +00.000 +00.000 +00.000 0",
    "0000000002.500 16777343 6665 laser 00 001 001 0001 -0.0175 +0.0175 +0.01745329 +8.0000 0003 "
    "1.000  0 7.999  0 8.000  0 ",
    "0000000003.000 16777343 6665 position2d 00 001 001 +02.000 +02.000 -03.100 +00.000 +00.000 +00.000 0",
]


def test_version_1(tmp_path):
    log = read(tmp_path, *V1)
    assert (log.format, log.laser) == ("Player, version 1", "laser:0")
    assert log.stamps == ("1067381970.050", "1067381970.075")
    # Player 1 has whole hundredths of a degree: −1.5708 is −90°, 0.7854 is 45°.
    np.testing.assert_array_equal(log.angle_min, [math.radians(-90)] * 2)
    np.testing.assert_array_equal(log.angle_increment, [math.radians(45)] * 2)
    expected = [[1, 2, 3, 8.191, math.nan], [1.5, 2.5, 3.5, 4.5, 5.5]]
    np.testing.assert_array_equal(log.ranges, np.array(expected, dtype=np.float32))
    # Half and three quarters of the way between both positions.
    assert log.odometry is not None
    np.testing.assert_allclose(log.odometry, [[1.1, 0.5, 0.2], [1.15, 0.5, 0.25]], atol=1e-6)
    assert log.report.used == {
        "laser": "the only laser",
        "odometry": "position:0, the only odometry, interpolated",
        "mounting": "assumed: at the robot's centre",
        "range_min": "none in a Player log",
        "range_max": "assumed, as for CARMEN",
    }
    assert log.report.records == {"sync:0": 1, "position:0": 2, "laser:0": 2}
    assert log.report.skipped == {}


def test_half_degrees_of_version_1_are_not_499_thousandths(tmp_path):
    # 0.0087 rad is 0.4985°: over 361 beams 0.5° would be lost.
    beams = " ".join(["1.000  0"] * 361)
    line = f"1.100 h 6665 laser 00 1.000 -1.5708 +1.5708 +0.0087 0361 {beams} "
    log = read(tmp_path, line)
    assert log.angle_min[0] + 360 * log.angle_increment[0] == pytest.approx(math.pi / 2, abs=1e-12)


def test_version_2(tmp_path):
    log = read(tmp_path, *V2)
    assert log.format == "Player, version 2"
    assert log.stamps == ("0000000002.500",)
    assert log.times.tolist() == [2.5]
    np.testing.assert_array_equal(log.angle_min, [-0.0175])
    np.testing.assert_array_equal(log.angle_increment, [0.01745329])
    # The farthest range, 8 m, is what a beam says that met nothing.
    np.testing.assert_array_equal(log.ranges, np.array([[1, 7.999, math.inf]], dtype=np.float32))
    assert log.range_limits == (0.0, 8.0)
    np.testing.assert_allclose(log.mount, (0.18, -0.02, 0.1))
    # From 3.1 to −3.1 rad over π: the middle is π.
    assert log.odometry is not None
    np.testing.assert_allclose(log.odometry[0, :2], (1.5, 2.0))
    assert abs(log.odometry[0, 2]) == pytest.approx(math.pi)
    assert log.report.used["mounting"] == "the geometry (4:1) of laser:0"
    assert log.report.warnings == ()


def test_version_2_with_poses_in_its_scans(tmp_path):
    head = "16777343 6665 laser 00 001 002"
    angles = "-1.0000 +1.0000 +1.00000000 +8.0000 0003 1.000  0 2.000  0 3.000  0 "
    log = read(
        tmp_path,
        f"1.000 {head} 0001 +01.000 +02.000 +00.500 {angles}",
        f"2.000 {head} 0002 +03.000 +04.000 +04.000 {angles}",
    )
    assert log.odometry is not None
    np.testing.assert_allclose(log.odometry, [[1, 2, 0.5], [3, 4, 4 - 2 * math.pi]])
    np.testing.assert_array_equal(log.ranges, [[1, 2, 3], [1, 2, 3]])
    assert log.report.used["odometry"] == "the poses in the scans (1:2)"


def test_poses_at_other_times_are_no_odometry(tmp_path):
    log = read(tmp_path, *(line.replace("0000000002.500", "0000000009.000") for line in V2))
    assert log.odometry is None
    assert log.report.used["odometry"] == "none: at other times"
    assert "no odometry" in log.report.warnings[0]


def test_options(tmp_path):
    log = read(tmp_path, *V2, options=ReadingOptions(mount=(1.0, 0.0, 0.0), odometry=False, max_range=5.0))
    np.testing.assert_array_equal(log.mount, (1, 0, 0))
    assert log.odometry is None
    np.testing.assert_array_equal(log.ranges, np.array([[1, math.inf, math.inf]], dtype=np.float32))


@pytest.mark.parametrize(
    ("more", "options", "said"),
    [
        ([V1[5].replace("laser 00", "laser 01")], {}, r"laser:0 \(2 records\), laser:1 .*--laser"),
        ([V1[4].replace("position 00", "position 01")], {}, r"position:0 .*, position:1 .*--odom-topic"),
        ([], {"laser": "laser:3"}, r"has no laser:3; --laser can be laser:0"),
        ([], {"odom_topic": "position:3"}, r"has no position:3; --odom-topic can be position:0"),
        ([], {"topic": "/scan"}, r"without topics; leave out --topic, see --laser"),
        ([V1[5].replace("6665", "6666")], {}, r"6665:laser:0 .*, 6666:laser:0 "),
    ],
)  # fmt: skip
def test_several_devices_have_to_be_chosen_from(tmp_path, more, options, said):
    with pytest.raises(WrongUsageError, match=said):
        read(tmp_path, *V1, *more, options=ReadingOptions(**options))


def test_the_chosen_device_is_read(tmp_path):
    second = [V1[5].replace("laser 00", "laser 01").replace("1.000  0", "7.000  0")]
    log = read(tmp_path, *V1, *second, options=ReadingOptions(laser="laser:1"))
    assert log.ranges[0, 0] == 7.0
    log = read(tmp_path, *V1, V1[4].replace("position 00", "position 01"),
               options=ReadingOptions(odom_topic="position:0"))  # fmt: skip
    assert log.report.used["odometry"] == "position:0, chosen by --odom-topic, interpolated"


MALFORMED = [
    ("1067381970.300 gates1 6665 laser 00 1067381970.300 -1.5708 +1.5708 +0.7854 0005 1.000  0 ",
     "wrong number of values"),
    ("1067381970.300 gates1 6665 laser 00 1067381970.300 -1.5708 +1.5708 +0.7854 five 1.000  0 ",
     "the beam count is not a number"),
    ("1067381970.300 gates1 6665 laser 00 1067381970.300 -1.5708 +1.5708 +0.7854 0001 1.0.0  0 ",
     "a value is not a number"),
    ("1067381970.300 gates1 6665 laser 00 1067381970.300 -1.5708 +1.5708 +0.0000 0001 1.000  0 ",
     "an angle or a pose is out of bounds"),
    ("1067381970.300 gates1 6665 laser 00 1067381970.300", "wrong number of values"),
    ("1067381970.300 gates1 6665 position 00 1067381970.300 +01.000", "wrong number of values"),
    ("1067381970.300 gates1", "not a Player record"),
]  # fmt: skip


@pytest.mark.parametrize(("line", "reason"), MALFORMED)
def test_malformed_records_are_counted(tmp_path, line, reason):
    log = read(tmp_path, *V1, line)
    assert log.report.skipped == {reason: (1, len(V1) + 1)}
    assert len(log) == 2
    with pytest.raises(InputDataError, match=f"line {len(V1) + 1}: {reason}"):
        read(tmp_path, *V1, line, options=ReadingOptions(strict=True))


def test_nothing_to_read(tmp_path):
    with pytest.raises(InputDataError, match="has no laser scans, only sync:0, position:0"):
        read(tmp_path, *V1[:5])
    with pytest.raises(InputDataError, match="line 1: no record of laser:0 can be read: wrong number"):
        read(tmp_path, V1[5].rsplit("  ", 2)[0])
    angles = "2.500 16777343 6665 laser 00 001 003 0001 +8.0000 0001 1.000 0.100  0 "
    with pytest.raises(InputDataError, match="has no laser scans, only position2d:0 1:1, laser:0 1:3"):
        read(tmp_path, V2[3], angles)


SCAN = st.lists(st.integers(1, 30_000), min_size=1, max_size=20)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(SCAN, min_size=1, max_size=5), st.sampled_from([1, 2]))
def test_what_is_written_is_read(tmp_path: Path, scans: list[list[int]], version: int):
    lines = []
    for k, millimetres in enumerate(scans):
        values = "".join(f"{mm / 1000:.3f} {mm % 9:2d} " for mm in millimetres)
        head = f"{k + 1:014.3f} 127 6665 laser 00"
        if version == 1:
            lines.append(f"{head} {k + 1:014.3f} -1.5708 +1.5708 +0.0175 {len(millimetres):04d} {values}")
        else:
            angles = f"-1.5708 +1.5708 +0.01745329 +80.0000 {len(millimetres):04d}"
            lines.append(f"{head} 001 001 {k:04d} {angles} {values}")
    log: LaserLog = read(tmp_path, *lines)
    assert len(log) == len(scans)
    for row, millimetres in zip(log.ranges, scans, strict=True):
        expected = np.array([float(f"{mm / 1000:.3f}") for mm in millimetres], dtype=np.float32)
        np.testing.assert_array_equal(row[: len(millimetres)], expected)
        assert np.isnan(row[len(millimetres) :]).all()
