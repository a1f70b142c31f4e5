"""Which stamps of messages were set, and when these tell their order."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.logs.recordings.message_stamps import order_messages, valid_stamps
from tests.logs.forms import FORMS
from tests.logs.recordings.messages import PERIOD, START, Odom, S, Scan, Tf, Written, drive


def test_zero_is_a_stamp_of_a_clock_that_begins_there():
    assert valid_stamps([0, S // 10, S // 5]) == [0, S // 10, S // 5]
    # The second of several messages at the beginning; of messages that are 5 s apart, the first too.
    assert valid_stamps([0, 0, S // 10, S // 10]) == [0, 0, S // 10, S // 10]
    assert valid_stamps([0, 5 * S, 10 * S]) == [0, 5 * S, 10 * S]


def test_zero_was_never_set_where_the_clock_began_long_ago():
    assert valid_stamps([START, 0, START + S]) == [START, None, START + S]
    assert valid_stamps([0, 37 * S, 38 * S]) == [None, 37 * S, 38 * S]
    assert valid_stamps([0, 0, 0]) == [None, None, None]
    assert valid_stamps([]) == []


@pytest.mark.parametrize(
    ("stamps", "tell"),
    [([0, 1, 2], True), ([5], True), ([None, 1, 2], True), ([None, None, 2], False), ([7, 7, 7], False)],
)
def test_stamps_tell_the_order_where_most_are_set_and_differ(stamps, tell):
    assert order_messages(stamps) == tell


def simulated(count: int, odom_in_tf: bool = False) -> list[Written]:
    """The first scans of a simulation that begins at 0, recorded from START on."""
    written = []
    for n in range(count):
        at, x = n * PERIOD, 0.1 * n
        tf = (Tf(at, "odom", "base_link", (x, 0.0, 0.0)),)
        one = (
            Written("/tf", START + at, tf)
            if odom_in_tf
            else Written("/odom", START + at, Odom(at, x, 0.0, 0.0))
        )
        written += [one, Written("/scan", START + at + 7, Scan(at, [1.0, 2.0, 3.0]))]
    return written


@pytest.mark.parametrize("form", ["ros1", "ros2", "protobuf", "json", "ROS 1 bag", "ROS 2 db3"])
@pytest.mark.parametrize("odom_in_tf", [False, True])
def test_a_simulation_that_begins_at_zero(form, odom_in_tf, read, tmp_path):
    log = read(FORMS[form](simulated(5, odom_in_tf=odom_in_tf), tmp_path), mount=(0.0, 0.0, 0.0))
    assert log.stamps[:2] == ("0.000000000", "0.100000000")
    np.testing.assert_allclose(log.odometry[:, 0], [0.0, 0.1, 0.2, 0.3, 0.4], atol=1e-9)
    assert log.report.warnings == ()


def test_a_scan_that_was_never_stamped_lies_between_others(read):
    written = drive()
    written[6] = written[6].with_scan(stamp=0)
    log = read(written)
    assert len(log) == 12
    np.testing.assert_allclose(np.diff(log.times), 0.1, atol=1e-6)
    assert "1 scan without a usable time stamp: interpolated between others" in log.report.warnings


def test_odometry_that_was_never_stamped_is_skipped(read):
    written = drive()
    assert isinstance(written[5].content, Odom)
    written[5] = Written("/odom", written[5].log_time, written[5].content._replace(stamp=0))
    log = read(written)
    assert log.report.skipped == {"/odom: without a time": (1, 3)}
    np.testing.assert_allclose(log.odometry[:, 0], 0.05 + 0.1 * np.arange(12), atol=1e-6)


def test_where_no_message_was_ever_stamped_the_times_of_recording_hold(read):
    written = [
        Written(one.topic, one.log_time, one.content._replace(stamp=0))
        for one in simulated(5)
        if isinstance(one.content, (Scan, Odom))
    ]
    log = read(written, mount=(0.0, 0.0, 0.0))
    assert log.stamps[0] == f"{(START + 7) // S}.{(START + 7) % S:09d}"
    np.testing.assert_allclose(log.odometry[:, 0], [0.0, 0.1, 0.2, 0.3, 0.4], atol=1e-6)
    assert "the scans' own time stamps are unusable: the times of recording are used" in log.report.warnings


@pytest.mark.parametrize("wrong", [(Scan, Odom), (Scan,), (Odom,)])
def test_where_stamps_are_in_milliseconds_the_times_of_recording_hold(wrong, read):
    written = [
        Written(one.topic, one.log_time, one.content._replace(stamp=1000 * one.content.stamp))
        if isinstance(one.content, wrong)
        else one
        for one in simulated(100)
    ]
    log = read(written, mount=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(np.diff(log.times), 0.1, atol=1e-6)
    np.testing.assert_allclose(log.odometry[:, 0], 0.1 * np.arange(100), atol=1e-6)
    assert any("unusable: the times of recording are used" in warning for warning in log.report.warnings)
