"""The .script form: cm and degrees become m and rad."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.logs.reading_options import ReadingOptions
from tests.logs.lines import read

LINES = [
    "# robot",
    "POS   976052857     0: 100.0 -50.0 90.0 0.0 0.0",
    "LASER-RANGE   976052857  500000 0 5 180.0: 100 200.5 8183 0 300",
    "POS   976052858     0: 200.0 -50.0 -90.0 0.0 0.0",
    "",
]


def test_a_scan_and_its_pose(tmp_path):
    log = read(tmp_path, *LINES)
    assert (log.format, log.laser) == (".script", "LASER-RANGE:0")
    assert log.stamps == ("976052857.500000",)
    np.testing.assert_array_equal(log.ranges, np.array([[1, 2.005, math.inf, math.nan, 3]], dtype=np.float32))
    assert math.degrees(log.angle_min[0]) == pytest.approx(-90)
    assert math.degrees(log.angle_increment[0]) == pytest.approx(45)
    # Half way from (1, −0.5, 90°) to (2, −0.5, −90°), turning through 0.
    assert log.odometry is not None
    np.testing.assert_allclose(log.odometry, [[1.5, -0.5, 0]], atol=1e-6)
    assert log.report.records == {"POS": 2, "LASER-RANGE:0": 1}


def test_malformed_records_are_counted(tmp_path):
    wrong = [
        "LASER-RANGE 976052857 600000 0 5 180.0: 100 200",
        "LASER-RANGE 976052857 600000 0 x 180.0: 100 200",
        "LASER-RANGE 976052857 600000 0 2: 100 200",
        "LASER-RANGE 976052857 600000 0 2 180.0: 100 2x0",
        "POS 976052858 0: 200.0",
        "what is this",
    ]
    log = read(tmp_path, *LINES, *wrong)
    assert log.report.skipped == {
        "wrong number of values": (2, 6),
        "the beam count is not a number": (1, 7),
        "the field of view is not in 0°…360°": (1, 8),
        "a value is not a number": (1, 9),
        "not a .script record": (1, 11),
    }
    assert len(log) == 1


def test_several_lasers_have_to_be_chosen_from(tmp_path):
    second = LINES[2].replace(" 0 5 ", " 1 5 ").replace("100 200.5", "700 200.5")
    with pytest.raises(WrongUsageError, match=r"LASER-RANGE:0 \(1 record\), LASER-RANGE:1 .*--laser"):
        read(tmp_path, *LINES, second)
    log = read(tmp_path, *LINES, second, options=ReadingOptions(laser="LASER-RANGE:1", mount=(0.1, 0, 0)))
    assert log.ranges[0, 0] == 7.0
    assert log.mount.tolist() == [0.1, 0, 0]
    with pytest.raises(WrongUsageError, match="has no LASER-RANGE:2"):
        read(tmp_path, *LINES, options=ReadingOptions(laser="LASER-RANGE:2"))


def test_without_poses_or_scans(tmp_path):
    log = read(tmp_path, LINES[2])
    assert log.odometry is None
    assert log.report.warnings == ("the log has no POS record: no odometry",)
    with pytest.raises(InputDataError, match="no LASER-RANGE record"):
        read(tmp_path, LINES[1])
    with pytest.raises(InputDataError, match="line 1: no LASER-RANGE:0 record can be read: wrong number"):
        read(tmp_path, LINES[2] + " 1")


def test_poses_at_other_times_are_no_odometry(tmp_path):
    log = read(tmp_path, LINES[1], LINES[3], LINES[2].replace("976052857", "976052900"))
    assert log.odometry is None
    assert log.report.used["odometry"] == "none: at other times"
