"""Logs with corrected poses, read back by the reader of CARMEN logs."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.errors import InputDataError
from nscan_cli.exports.carmen import corrected_log
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, relative
from tests.exports.small_run import POSES, small_log
from tests.mapping.handmade_logs import log_of

SIGN = "its host is nscan-cli, which writes corrected poses"

CORRECTED = ReadingOptions(allow_corrected=True)


def read_back(folder: Path, log: LaserLog, poses: Array = POSES) -> tuple[str, LaserLog]:
    """The text that is written, and the log that it is for our reader."""
    data = corrected_log(log, np.arange(len(log)), poses)
    path = folder / "corrected.log"
    path.write_bytes(data)
    return data.decode(), read_log(str(path), CORRECTED, even_unusable=True)


def assert_the_same_scans(back: LaserLog, log: LaserLog, poses: Array = POSES) -> None:
    np.testing.assert_array_equal(back.ranges, log.ranges)
    np.testing.assert_allclose(back.angle_min, log.angle_min, atol=1e-6)
    np.testing.assert_allclose(back.angle_increment, log.angle_increment, atol=1e-8)
    np.testing.assert_allclose(relative(back.mount, log.mount), 0, atol=1e-6)
    assert back.stamps == log.stamps
    assert back.odometry is not None
    np.testing.assert_allclose(relative(back.odometry, poses), 0, atol=2e-9)
    assert back.report.skipped == {}


def test_a_log_has_this_text():
    log = dataclasses.replace(log_of([[1.5, 2.25, np.inf], [np.nan, 81.0 / 8, 0.1]], -np.pi / 2, np.pi / 2,
                                     (0.04, 0, 0)), stamps=("12.50", "13"), times=np.array([12.5, 13.0]),
                              no_return=81.83)  # fmt: skip
    poses = np.array([[1.0, 2.0, np.pi / 2], [-0.0, 0.1, -4.0]])
    text = corrected_log(log, np.arange(2), poses).decode()
    # −4 rad is 2π − 4 = 2.283185307; cos and sin of it, times 0.04 m, are −0.026145745 and 0.030272100.
    assert text.splitlines()[2:] == [
        "PARAM robot_frontlaser_offset 0.04 0 nscan-cli 0",
        "PARAM robot_frontlaser_side_offset 0.0 0 nscan-cli 0",
        "PARAM robot_frontlaser_angular_offset 0.0 0 nscan-cli 0",
        "PARAM robot_front_laser_max 80.0 0 nscan-cli 0",
        "PARAM laser_front_laser_resolution 90.0 0 nscan-cli 0",
        "FLASER 3 1.5 2.25 81.83 1.000000000 2.040000000 1.570796327 1.000000000 2.000000000 1.570796327 "
        "12.50 nscan-cli 0.000000",
        "FLASER 3 0 10.125 0.1 -0.026145745 0.130272100 2.283185307 0.000000000 0.100000000 2.283185307 "
        "13 nscan-cli 0.500000",
    ]


def test_what_is_written_reads_back(tmp_path):
    log = small_log()
    text, back = read_back(tmp_path, log)
    assert_the_same_scans(back, log)
    assert "\nFLASER 181 " in text
    assert back.laser == "FLASER"


@pytest.mark.parametrize(
    "changes",
    [
        {"angle_min": np.full(5, -2.0)},
        {"angle_increment": np.full(5, -np.pi / 180), "angle_min": np.full(5, np.pi / 2)},
        {"angle_min": np.linspace(-2, -1, 5)},
        {"range_limits": (0.1, 100.0), "no_return": None},
        {"range_limits": (0.0, float("inf")), "no_return": None},
    ],
)
def test_what_flaser_cannot_say_reads_back_too(tmp_path, changes: dict[str, Any]):
    """Other directions, clockwise beams, other directions in each scan, and lasers that reach far."""
    log = dataclasses.replace(small_log(), **changes)
    if "range_limits" in changes and np.isfinite(changes["range_limits"][1]):
        log.ranges[2, 7] = 99.5
    text, back = read_back(tmp_path, log)
    assert_the_same_scans(back, log)
    plain = changes.get("range_limits", (0.0, 80.0))[1] == float("inf")
    assert (back.laser, "\nFLASER" in text) == (("FLASER", True) if plain else ("ROBOTLASER1", False))


def test_scans_have_their_own_beams(tmp_path):
    own = np.array([181, 90, 181, 181, 2])
    log = dataclasses.replace(small_log(), beams=own)
    for scan, beams in zip(log.ranges, own, strict=True):
        scan[beams:] = np.nan
    _, back = read_back(tmp_path, log)
    assert_the_same_scans(back, log)
    assert back.beam_counts().tolist() == own.tolist()
    assert back.report.warnings == (f"the poses are a mapper's result, not odometry ({SIGN})",)


def test_a_laser_that_sees_far_without_a_limit(tmp_path):
    log = dataclasses.replace(small_log(), range_limits=(0.0, float("inf")), no_return=None)
    log.ranges[1, 9] = 123.4
    _, back = read_back(tmp_path, log)
    assert_the_same_scans(back, log)


@settings(max_examples=30, deadline=None)
@given(
    st.lists(
        st.floats(0.015625, 79, width=32) | st.just(np.inf) | st.just(np.nan), min_size=181, max_size=181
    )
)
def test_every_range_reads_back_to_the_bit(tmp_path_factory, ranges: list[float]):
    log = dataclasses.replace(log_of([ranges], -np.pi / 2, np.pi / 180), no_return=None)
    _, back = read_back(tmp_path_factory.mktemp("carmen"), log, POSES[:1])
    np.testing.assert_array_equal(back.ranges, log.ranges)


def test_limits_just_above_a_value_of_32_bits_stay_short(tmp_path):
    """As ROS has them: a beam of the greatest range counts."""
    limits = (0.0, float(np.nextafter(np.float32(3.5), np.float32(4))))
    log = dataclasses.replace(small_log(), range_limits=limits, no_return=None)
    log.ranges[np.isfinite(log.ranges)] /= 2.5
    log.ranges[:, 50] = 3.5
    text, back = read_back(tmp_path, log)
    assert_the_same_scans(back, log)
    assert "PARAM robot_front_laser_max 3.5000002 " in text
    assert back.range_limits[1] == pytest.approx(3.5)


def test_it_is_known_for_a_corrected_log_and_no_input_of_slam(tmp_path):
    data = corrected_log(small_log(), np.arange(5), POSES)
    (tmp_path / "corrected.log").write_bytes(data)
    with pytest.raises(InputDataError, match="its host is nscan-cli, which writes corrected poses"):
        read_log(str(tmp_path / "corrected.log"))


def test_records_have_the_lengths_that_carmen_reads(tmp_path):
    """FLASER: n, ranges, six numbers, three of the trailer (CARMEN, src/logger/readlog.c)."""
    text, _ = read_back(tmp_path, small_log())
    lengths = {len(line.split()) for line in text.splitlines() if line.startswith("FLASER")}
    assert lengths == {1 + 1 + 181 + 6 + 3}
    other = dataclasses.replace(small_log(), angle_min=np.full(5, -2.0))
    text, _ = read_back(tmp_path, other)
    lengths = {len(line.split()) for line in text.splitlines() if line.startswith("ROBOTLASER1")}
    # Seven of the laser's numbers, n, ranges, no remissions, two poses, five more, three of the trailer.
    assert lengths == {1 + 7 + 1 + 181 + 1 + 6 + 5 + 3}


def test_rows_may_be_some_of_the_log(tmp_path):
    log = small_log()
    data = corrected_log(log, np.array([1, 4]), POSES[[0, 2]])
    (tmp_path / "some.log").write_bytes(data)
    back = read_log(str(tmp_path / "some.log"), CORRECTED)
    assert back.stamps == (log.stamps[1], log.stamps[4])
    np.testing.assert_array_equal(back.ranges, log.ranges[[1, 4]])
