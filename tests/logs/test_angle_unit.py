"""Angles of beams in degrees are told by their size, in recordings and text logs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.logs import noisy_room
from tests.logs.lines import read as read_lines

FIRST, STEP, LAST = (
    round(math.degrees(angle))
    for angle in (noisy_room.FIRST, noisy_room.STEP, noisy_room.FIRST + 179 * noisy_room.STEP)
)


def directions(log) -> list[float]:
    """First direction and step of the first scan, rad."""
    return [float(log.angle_min[0]), float(log.angle_increment[0])]


@pytest.mark.parametrize(
    "angles",
    [
        {"angle_min": FIRST, "step": STEP, "last": LAST},
        {"angle_min": FIRST, "step": STEP, "last": 0.0},
        {"step": STEP, "last": -noisy_room.FIRST - noisy_room.STEP},
        {"angle_min": FIRST, "last": LAST},
    ],
)
def test_degrees_in_a_recording_are_converted_and_it_is_said(read, angles):
    written = noisy_room.recording(noisy_room.readings(), **angles)
    log = read(written)
    np.testing.assert_allclose(directions(log), [noisy_room.FIRST, noisy_room.STEP], rtol=1e-6)
    (said,) = log.report.contradictions
    assert said.startswith("the angles of the beams are in degrees")
    assert read(written, as_recorded=True).report.contradictions == ()


def test_degrees_in_a_carmen_log_are_converted(tmp_path):
    ranges = " ".join(["2.0"] * 180)
    line = "ROBOTLASER1 0 -180 358 2 20 0 0 180 {} 0 0 0 0 0 0 0 0 0 0 0 0 {} h 0"
    log = read_lines(tmp_path, *(line.format(ranges, stamp) for stamp in range(9)))
    np.testing.assert_allclose(directions(log), np.radians([-180.0, 2.0]))


def test_angles_in_radians_stay(read):
    for angles in ({}, {"angle_min": 0.0, "step": 3 * noisy_room.STEP}, {"angle_min": 2 * math.pi}):
        log = read(noisy_room.recording(noisy_room.readings(), **angles))
        assert not any("degrees" in said for said in log.report.contradictions)
