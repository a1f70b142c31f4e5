"""Two lasers on one topic in one frame are told apart; one laser is not taken for two."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nscan_cli.logs.load import read_log
from nscan_cli.poses import compose
from tests.data import data_file
from tests.logs.noisy_room import FIRST, readings, readings_at, recording
from tests.logs.recordings.messages import Scan, Written

FRONT, REAR = readings(), readings(first=FIRST + math.pi / 2)


def alternating(without: tuple[int, ...] = ()) -> list[Written]:
    """Each scan is followed by one of a laser that looks to the left; some messages are lost."""
    written: list[Written] = []
    rear = iter(REAR)
    for one in recording(FRONT, range_max=20.0):
        written.append(one)
        if isinstance(one.content, Scan):
            scan = one.content._replace(stamp=one.content.stamp + 10**7, ranges=next(rear))
            written.append(Written("/scan", one.log_time + 10**7, scan))
    scans = [row for row, one in enumerate(written) if isinstance(one.content, Scan)]
    lost = [scans[number] for number in without]
    return [one for row, one in enumerate(written) if row not in lost]


def test_the_scans_of_the_first_are_read_and_the_other_is_told(read):
    log = read(alternating())
    np.testing.assert_array_equal(log.ranges, FRONT)
    (said,) = log.report.contradictions
    assert said.startswith("two lasers alternate in one frame, base_link")
    assert "only the 40 scans" in said


def test_lost_scans_do_not_mix_them(read):
    """Scan 20 is the first laser's, 41 and 51 are the other's."""
    log = read(alternating(without=(20, 41, 51)))
    np.testing.assert_array_equal(log.ranges, np.delete(FRONT, 10, axis=0))


def test_lasers_that_look_the_same_way_on_a_robot_that_turns(read):
    """The other laser is 0.6 m ahead. Over 0.7 rad a scan resembles that of the other laser more."""
    poses = np.zeros((60, 3))
    poses[:, 0] = 5.0 + 0.05 * np.minimum(np.arange(60), 20) + 0.05 * np.maximum(np.arange(60) - 40, 0)
    poses[:, 1] = 2.0
    poses[:, 2] = 0.035 * np.clip(np.arange(60) - 20, 0, 20)
    front, ahead = readings_at(poses), readings_at(compose(poses, np.array([0.6, 0.0, 0.0])))
    written: list[Written] = []
    other = iter(ahead)
    for one in recording(front, range_max=20.0):
        written.append(one)
        if isinstance(one.content, Scan):
            scan = one.content._replace(stamp=one.content.stamp + 10**7, ranges=next(other))
            written.append(Written("/scan", one.log_time + 10**7, scan))
    log = read(written)
    np.testing.assert_array_equal(log.ranges, front)
    assert "only the 60 scans" in log.report.contradictions[0]


def test_the_log_as_recorded(read):
    log = read(alternating(), as_recorded=True)
    assert len(log) == 80
    assert log.report.contradictions == ()


@pytest.mark.parametrize("moves", [True, False])
def test_one_laser_is_one(read, moves):
    ranges = (
        FRONT if moves else readings(1).repeat(40, axis=0) + np.float32(0.01) * np.eye(40, 180, dtype="f")
    )
    log = read(recording(ranges, range_max=20.0))
    assert len(log) == 40
    assert log.report.contradictions == ()


@pytest.mark.logs
def test_the_recording_of_a_stranger():
    log = read_log(str(data_file("strangers/two-lasers-one-frame.mcap")))
    assert len(log) == 600
    np.testing.assert_allclose(np.diff(log.times), 0.2, atol=1e-6)
    assert "two lasers alternate in one frame, front" in log.report.contradictions[0]
