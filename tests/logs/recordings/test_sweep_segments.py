"""Turns of a laser in several messages become scans, whatever the order, the pauses and what is missing."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nscan_cli.logs.load import read_log
from tests.data import data_file
from tests.logs.noisy_room import FIRST, STEP, readings, recording
from tests.logs.recordings.messages import PERIOD, Scan, Written


def in_segments(
    parts: int, pause: int, first: float = FIRST, step: float = STEP, begin: int = 0
) -> list[Written]:
    """The recording of the noisy room with scans in so many messages, `pause` ns apart.

    It begins with segment `begin`; bearings are between −π and π.
    """
    written: list[Written] = []
    for one in recording(readings(first=first, step=step), range_max=20.0):
        scan = one.content
        if not isinstance(scan, Scan):
            written.append(one)
            continue
        size = len(scan.ranges) // parts
        for part in range(parts):
            bearing = first + part * size * step
            ranges = scan.ranges[part * size : (part + 1) * size]
            later = part * pause
            segment = scan._replace(
                stamp=scan.stamp + later, ranges=ranges, step=step,
                angle_min=math.remainder(bearing, 2 * math.pi),
            )  # fmt: skip
            written.append(Written("/scan", one.log_time + later, segment))
    segments = [row for row, one in enumerate(written) if isinstance(one.content, Scan)]
    return [one for row, one in enumerate(written) if row not in segments[:begin]]


@pytest.mark.parametrize("pause", [10**6, PERIOD // 6])
@pytest.mark.parametrize(
    ("first", "step"), [(FIRST, STEP), (0.0, STEP), (math.pi / 2, -STEP), (-2.0, STEP / 2)]
)
def test_each_turn_becomes_a_scan(read, first, step, pause):
    """In a burst or all the time, clockwise or not, of a full turn or of half."""
    log = read(in_segments(6, pause, first, step))
    whole = readings(first=first, step=step)
    assert log.ranges.shape == whole.shape
    for row in range(len(log)):
        bearings = log.angle_min[row] + log.angle_increment[row] * np.arange(180)
        # The same readings at the same bearings, wherever the scan begins.
        apart = np.round((bearings - first) / step).astype(int) % round(2 * math.pi / abs(step))
        there = apart < 180
        np.testing.assert_allclose(log.ranges[row, there], whole[row, apart[there]], rtol=1e-6)
        assert there.all()
    (said,) = log.report.contradictions
    assert said.startswith(f"a turn of the laser comes in 6 messages of {math.degrees(abs(step)) * 30:.0f}°")


def test_the_time_is_that_of_the_middle(read):
    segments = in_segments(6, 10**7)
    log = read(segments)
    stamps = [one.content.stamp for one in segments if isinstance(one.content, Scan)]
    np.testing.assert_allclose(log.times, np.array(stamps[3::6]) / 1e9, atol=1e-6)


def test_a_recording_that_begins_within_a_turn_and_one_with_a_gap(read):
    begun = read(in_segments(6, 10**6, begin=2))
    assert np.isnan(begun.ranges[0, :60]).all()
    np.testing.assert_array_equal(begun.ranges[1:], readings()[1:])
    segments = in_segments(6, 10**6)
    scans = [row for row, one in enumerate(segments) if isinstance(one.content, Scan)]
    lost = read([one for row, one in enumerate(segments) if row != scans[63]])
    assert len(lost) == 40
    assert np.isnan(lost.ranges[10, 90:120]).all()
    np.testing.assert_array_equal(np.delete(lost.ranges, 10, axis=0), np.delete(readings(), 10, axis=0))


def test_the_log_as_recorded(read):
    log = read(in_segments(6, 10**6), as_recorded=True)
    assert log.ranges.shape == (240, 30)
    assert log.report.contradictions == ()


@pytest.mark.parametrize("first", [FIRST, -math.pi / 4])
def test_whole_scans_are_left_alone(read, first):
    log = read(recording(readings(first=first), range_max=20.0, angle_min=first))
    assert log.ranges.shape == (40, 180)
    assert log.report.contradictions == ()


@pytest.mark.logs
def test_the_recording_of_a_stranger():
    log = read_log(str(data_file("strangers/segments.mcap")))
    assert log.ranges.shape == (600, 360)
    assert "6 messages of 60°" in log.report.contradictions[0]
