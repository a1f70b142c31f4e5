"""Headings that were written into quaternions otherwise are told by the way that the robot drives."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nscan_cli.logs.recordings.decoded_messages import Pose3D
from nscan_cli.logs.recordings.orientations import headings_of
from nscan_cli.poses import Array, wrap
from tests.logs.recordings.messages import START, Scan, Tf, Written

HEADINGS = np.linspace(-3.0, 3.0, 200)
"""rad; of a robot that drives along nearly a circle."""


X, Y = np.cumsum(0.1 * np.cos(HEADINGS)), np.cumsum(0.1 * np.sin(HEADINGS))


def poses(rotations: Array) -> list[Pose3D]:
    """Poses with these quaternions (200, 4)."""
    return [Pose3D((*place, 0.0), tuple(each)) for *place, each in zip(X, Y, rotations.tolist(), strict=True)]


def written(z: Array, w: Array) -> Array:
    return np.stack([0.0 * z, 0.0 * z, z, w + 0.0 * z], axis=1)


@pytest.mark.parametrize("w", [0.0, 1.0])
@pytest.mark.parametrize("unit", ["radians", "degrees"])
def test_the_heading_in_z(w, unit):
    z = HEADINGS if unit == "radians" else np.degrees(HEADINGS)
    found, said = headings_of(poses(written(z, np.array(w))))
    np.testing.assert_allclose(np.array(found, dtype=float), HEADINGS, atol=1e-9)
    assert f"z is the heading in {unit}" in said


def test_w_first():
    right = written(np.sin(HEADINGS / 2), np.cos(HEADINGS / 2))
    found, said = headings_of(poses(np.roll(right, 1, axis=1)))
    np.testing.assert_allclose(wrap(np.array(found) - HEADINGS), 0.0, atol=1e-9)
    assert "w comes first" in said


@pytest.mark.parametrize("length", [1.0, 0.7, 3.0])
def test_rotations_are_read_as_such_whatever_their_length(length):
    right = length * written(np.sin(HEADINGS / 2), np.cos(HEADINGS / 2))
    right[5] = 0.0
    found, said = headings_of(poses(right))
    assert found[5] is None
    assert said == ""
    np.testing.assert_allclose(np.delete(np.array(found, dtype=float), 5), np.delete(HEADINGS, 5), atol=1e-9)


def test_what_no_way_tells_is_left_as_it_is():
    assert headings_of(poses(written(7.0 * HEADINGS, np.array(0.0))))[1] == ""
    assert headings_of(poses(written(HEADINGS, np.array(0.0)))[:4])[1] == ""
    assert headings_of([]) == ([], "")


def test_a_recording_is_put_right_and_as_recorded_is_not(read):
    """Degrees in z."""
    messages = []
    for n, heading in enumerate(HEADINGS.tolist()):
        at = START + n * 10**8
        tf = (Tf(at, "odom", "base_link", (X[n], Y[n], 0.0), (0.0, 0.0, math.degrees(heading), 0.0)),)
        messages += [Written("/tf", at, tf), Written("/scan", at, Scan(at, [1.0, 2.0, 3.0]))]
    log = read(messages, mount=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(log.odometry[:, 2], HEADINGS, atol=1e-6)
    assert "z is the heading in degrees" in log.report.contradictions[0]
    log = read(messages, mount=(0.0, 0.0, 0.0), as_recorded=True)
    assert log.report.contradictions == ()
