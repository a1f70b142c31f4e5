"""Recordings of every form give the same scans, odometry and mounting; and what is said about odd ones."""

from __future__ import annotations

import dataclasses
import gzip
import io
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.logs.load import read_log
from tests.logs.forms import FORMS
from tests.logs.recordings.messages import (
    COUNT,
    PERIOD,
    START,
    Odom,
    S,
    Scan,
    Written,
    check_drive,
    drive,
    with_scans,
)
from tests.logs.recordings.ros import ros1, ros2


@pytest.mark.parametrize("form", FORMS)
def test_every_form_gives_the_same(form, read, tmp_path):
    log = read(FORMS[form](drive(), tmp_path))
    check_drive(log)
    assert log.laser == "/scan"
    assert sum(log.report.records.values()) == 1 + 13 + 12


@pytest.mark.parametrize("form", ["ros2", "ROS 1 bag", "ROS 2 db3"])
def test_packed_and_from_standard_input(form, tmp_path, monkeypatch):
    packed = gzip.compress(FORMS[form](drive(), tmp_path))
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(packed)))
    log = read_log("-")
    check_drive(log)
    assert (log.source.name, log.source.bytes) == ("standard input", len(packed))


def test_limits_count_and_what_is_no_number_says_nothing(read):
    inf, nan = math.inf, math.nan
    ranges = np.array([0.05, 0.1, 5.0, 30.0, 30.5, inf, -inf, nan, 0.0], dtype=np.float32)
    log = read(with_scans(ranges=ranges))
    expected = np.array([nan, 0.1, 5.0, 30.0, inf, inf, nan, nan, nan], dtype=np.float32)
    np.testing.assert_array_equal(log.ranges, [expected] * COUNT)
    np.testing.assert_allclose(log.range_limits, (0.1, 30.0), atol=1e-5)
    np.testing.assert_array_equal(
        read(with_scans(ranges=ranges), min_range=1.0, max_range=20.0).ranges[0],
        np.array([nan, nan, 5.0, inf, inf, inf, nan, nan, nan], dtype=np.float32),
    )


def test_limits_that_change_from_scan_to_scan(read):
    written = drive()
    for at, one in enumerate(written):
        if isinstance(one.content, Scan):
            far = 2.0 if at % 4 else 5.0
            written[at] = one.with_scan(range_max=far)
    farthest = {2.0: 0, 5.0: 0}
    scans = [one.content for one in written if isinstance(one.content, Scan)]
    for scan, ranges in zip(scans, read(written).ranges, strict=True):
        np.testing.assert_array_equal(np.isinf(ranges), scan.ranges > scan.range_max)
        farthest[scan.range_max] += 1
    assert all(farthest.values())


def test_scans_of_different_lengths_and_without_limits(read):
    written = with_scans(range_min=0.0, range_max=0.0)
    last = max(at for at, one in enumerate(written) if isinstance(one.content, Scan))
    written[last] = written[last].with_scan(ranges=np.array([500.0, 2.0], dtype=np.float32))
    log = read(written)
    assert log.ranges.shape == (COUNT, 5)
    np.testing.assert_array_equal(
        log.ranges[-1], np.array([500, 2, math.nan, math.nan, math.nan], np.float32)
    )


def test_two_lasers_have_to_be_chosen_from(read):
    second = [one for one in drive(scan_topic="/rear") if isinstance(one.content, Scan)]
    both = sorted(drive() + second, key=lambda one: one.log_time)
    with pytest.raises(WrongUsageError, match=r"/rear \(12 messages\), /scan \(12 messages\).*--topic"):
        read(both)
    assert read(both, topic="/rear").laser == "/rear"
    assert read(both, topic="/rear").report.used["laser"] == "chosen by --topic"
    with pytest.raises(
        WrongUsageError, match=r"/odom is of nav_msgs/msg/Odometry; --topic can be /rear .*, /scan"
    ):
        read(both, topic="/odom")
    with pytest.raises(WrongUsageError, match="has no topic /front"):
        read(both, topic="/front")
    with pytest.raises(WrongUsageError, match="--topic"):
        read(both, laser="FLASER")


def test_two_odometries_have_to_be_chosen_from(read):
    wheels = [dataclasses.replace(one, topic="/wheels") for one in drive() if isinstance(one.content, Odom)]
    both = sorted(drive() + wheels, key=lambda one: one.log_time)
    with pytest.raises(
        WrongUsageError, match=r"/odom \(13 messages\), /wheels .*--odom-topic.*--no-odometry"
    ):
        read(both)
    assert (
        read(both, odom_topic="/wheels").report.used["odometry"].startswith("/wheels, chosen by --odom-topic")
    )
    with pytest.raises(WrongUsageError, match=r"/scan is of .*LaserScan; --odom-topic can be /odom"):
        read(both, odom_topic="/scan")
    without = read(both, odometry=False)
    assert without.odometry is None
    assert without.report.used["odometry"] == "none: --no-odometry"
    np.testing.assert_allclose(without.mount, (0.2, 0.1, 0.3), atol=1e-9)


def test_no_scans_at_all(read):
    with pytest.raises(InputDataError, match=r"no laser scans, only /odom \(nav_msgs/msg/Odometry\)"):
        read([one for one in drive() if not isinstance(one.content, Scan)])


def test_odometry_from_tf(read):
    log = read(drive(odom_topic=None, odom_in_tf=True))
    assert log.report.used["odometry"].startswith("tf from odom to base_link, no topic has odometry")
    middle = np.arange(COUNT) + 0.5
    np.testing.assert_allclose(log.odometry[:, 0], 0.1 * middle, atol=1e-6)
    np.testing.assert_allclose(log.odometry[:, 2], 0.01 * middle, atol=1e-6)
    np.testing.assert_allclose(log.mount, (0.2, 0.1, 0.3), atol=1e-9)
    asked = read(drive(odom_in_tf=True), odom_topic="/tf")
    assert asked.report.used["odometry"].startswith("tf from odom to base_link, /tf is asked for")


def test_no_odometry(read):
    log = read(drive(odom_topic=None))
    assert log.odometry is None
    assert log.report.used["odometry"] == "none in the recording"
    assert any("no odometry" in warning for warning in log.report.warnings)
    # base_link is where the mounting starts where no odometry names another frame.
    np.testing.assert_allclose(log.mount, (0.2, 0.1, 0.3), atol=1e-9)


def test_odometry_at_other_times_is_none(read):
    late = [
        dataclasses.replace(one, content=one.content._replace(stamp=one.content.stamp + 3600 * S))
        if isinstance(one.content, Odom) else one
        for one in drive()
    ]  # fmt: skip
    log = read(late)
    assert log.odometry is None
    assert any("no scan lies between" in warning for warning in log.report.warnings)


def test_scans_without_stamps_have_the_times_of_recording(read):
    log = read(with_scans(stamp=0))
    at = START + PERIOD // 2 + 7
    assert log.stamps[0] == f"{at // S}.{at % S:09d}"
    assert "the times of recording are used" in log.report.warnings[0]
    np.testing.assert_allclose(log.odometry[:, 0], 0.1 * (np.arange(COUNT) + 0.5), atol=1e-6)


def test_a_scan_that_is_nonsense_is_skipped_and_counted(read):
    written = drive()
    scans = [at for at, one in enumerate(written) if isinstance(one.content, Scan)]
    wrong: dict[int, dict[str, Any]] = {
        2: {"ranges": np.array([], dtype=np.float32)},
        5: {"angle_min": math.nan},
        7: {"frame": "another"},
    }
    for number, changes in wrong.items():
        at = scans[number]
        written[at] = written[at].with_scan(**changes)
    log = read(written)
    assert len(log) == COUNT - 3
    assert log.report.skipped == {
        "the beam count is not in 1…16384": (1, 3),
        "an angle is out of bounds": (1, 6),
        "/scan: a scan in another frame than laser": (1, 8),
    }
    assert "first in message 3" in log.report.notices()[0]
    with pytest.raises(InputDataError, match="message 3: the beam count"):
        read(written, strict=True)


READINGS = st.lists(st.floats(width=32), min_size=1, max_size=30)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(READINGS, min_size=1, max_size=4), st.sampled_from([ros1, ros2]))
def test_any_readings_are_read_as_the_message_says(read, scans, form):
    written = [
        Written("/scan", START + k, Scan(START + k * S, np.array(values, dtype=np.float32), "base_link"))
        for k, values in enumerate(scans)
    ]
    log = read(form(written), even_unusable=True)
    low, high = np.float32(0.1), np.float32(30.0)
    for row, values in zip(log.ranges, scans, strict=True):
        readings = np.array(values, dtype=np.float32)
        expected = np.where(
            readings > high, np.float32(np.inf), np.where(readings >= low, readings, np.float32(np.nan))
        )
        # A log of few scans has no peak of no-returns but SICK's, which lie beyond the limit here.
        np.testing.assert_array_equal(row[: len(values)], expected)
        assert np.isnan(row[len(values) :]).all()
