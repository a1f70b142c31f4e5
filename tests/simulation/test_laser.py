"""The simulated laser against ranges that can be calculated by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.simulation.laser import Laser, cast, exact, measure
from tests.simulation.world import Builder, World

CENTRED = exact(Laser(mount=(0.0, 0.0, 0.0)))
ALL_ROUND = exact(Laser(beams=360, angle_min=-np.pi, mount=(0.0, 0.0, 0.0)))


def wall_at(x: float, half: float = 1000.0, absorption: float = 0.0) -> World:
    builder = Builder()
    builder.line(x, -half, x, half, absorption)
    return builder.world()


def generator() -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(5))


@settings(max_examples=50, deadline=None)
@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3.1, 3.1))
def test_ranges_to_a_wall_are_exact(x, y, heading):
    # A beam of direction a meets the wall x = 5 after (5 − x) / cos a, or never.
    ranges, incidence, _ = cast(wall_at(5.0), np.array([[x, y, heading]]), ALL_ROUND)
    cosine = np.cos(heading + ALL_ROUND.angles())
    facing = cosine > 0.05
    np.testing.assert_allclose(ranges[0, facing], (5 - x) / cosine[facing], rtol=1e-9)
    np.testing.assert_allclose(np.cos(incidence[0, facing]), cosine[facing], rtol=1e-6)
    assert np.isinf(ranges[0, cosine < 0]).all()


@settings(max_examples=50, deadline=None)
@given(st.floats(0.5, 6), st.floats(-3.1, 3.1), st.floats(0.05, 0.4))
def test_ranges_to_a_pillar_are_exact(distance, bearing, radius):
    builder = Builder()
    builder.line(100.0, -1.0, 100.0, 1.0)
    builder.pillar(distance * np.cos(bearing), distance * np.sin(bearing), radius)
    ranges, _, _ = cast(builder.world(), np.zeros((1, 3)), ALL_ROUND)
    # d cos β − √(r² − d² sin² β), β the angle between beam and centre.
    beta = ALL_ROUND.angles() - bearing
    inside = radius**2 - (distance * np.sin(beta)) ** 2
    hit = (inside > 1e-9) & (np.cos(beta) > 0)
    np.testing.assert_allclose(ranges[0, hit], distance * np.cos(beta[hit]) - np.sqrt(inside[hit]), rtol=1e-9)
    assert (ranges[0, inside < -1e-9] > 50).all()


def test_the_nearest_obstacle_hides_the_others():
    builder = Builder()
    for x in (5.0, 3.0, 4.0):
        builder.line(x, -50, x, 50, absorption=x)
    builder.pillar(2.0, 0.0, 0.5)
    ranges, _, absorption = cast(builder.world(), np.zeros((1, 3)), CENTRED)
    assert ranges[0, 90] == pytest.approx(1.5)
    assert absorption[0, 90] == 0.0
    assert ranges[0, 130] == pytest.approx(3 / np.cos(np.radians(40)))
    assert absorption[0, 130] == 3.0


def test_the_mount_moves_the_laser():
    mounted = exact(Laser(mount=(0.1, 0.2, np.pi)))
    ranges, _, _ = cast(wall_at(-2.0), np.zeros((1, 3)), mounted)
    assert ranges[0, 90] == pytest.approx(2.1)


def test_many_scans_are_those_of_each_alone():
    poses = np.array([[0.1 * k, 0.3, 0.2 * k] for k in range(40)])
    together = cast(wall_at(5.0), poses, ALL_ROUND)[0]
    alone = np.concatenate([cast(wall_at(5.0), pose[None], ALL_ROUND)[0] for pose in poses])
    np.testing.assert_array_equal(together, alone)


def test_noise_is_as_large_as_said_and_rounded():
    laser = Laser(beams=1, angle_min=0.0, dropout=0.0, mount=(0.0, 0.0, 0.0))
    readings = measure(wall_at(5.0), np.zeros((4000, 3)), laser, generator())
    assert readings.mean() == pytest.approx(5.0, abs=0.001)
    # 1.5 cm and the rounding's 1 cm / √12.
    assert readings.std() == pytest.approx(np.hypot(0.015, 0.01 / np.sqrt(12)), rel=0.05)
    np.testing.assert_allclose(readings, np.round(readings, 2), atol=1e-12)


@pytest.mark.parametrize(
    ("laser", "absorption", "share"),
    [(Laser(dropout=0.1), 0.0, 0.1), (Laser(dropout=0.0), 0.6, 0.6), (Laser(dropout=0.5), 0.5, 0.75)],
)
def test_beams_are_lost_as_often_as_said(laser, absorption, share):
    head_on = Laser(beams=1, angle_min=0.0, dropout=laser.dropout)
    readings = measure(wall_at(5.0, absorption=absorption), np.zeros((4000, 3)), head_on, generator())
    assert (readings == 81.91).mean() == pytest.approx(share, abs=0.03)


def test_grazing_beams_are_lost_half_of_the_time():
    laser = Laser(beams=1, angle_min=np.radians(85), dropout=0.0, noise=0.0)
    readings = measure(wall_at(1.0), np.zeros((2000, 3)), laser, generator())
    assert (readings == 81.91).mean() == pytest.approx(0.5, abs=0.05)


def test_beyond_the_maximum_nothing_returns():
    assert (measure(wall_at(30.2), np.zeros((1, 3)), exact(Laser()), generator()) == 81.91).all()


def test_openings_of_a_wall_have_frames():
    builder = Builder()
    builder.wall((0, 0), (10, 0), openings=((4.0, 1.0), (7.0, 2.0)), thickness=0.2)
    world = builder.world()
    # Three boxes: to 3.5, from 4.5 to 6, from 8 on; half a thickness more at the ends.
    assert len(world.segments) == 12
    xs = np.unique(np.round(world.segments[:, 0], 9))
    np.testing.assert_allclose(xs, [-0.1, 3.5, 4.5, 6.0, 8.0, 10.1])
    np.testing.assert_allclose(np.unique(np.round(world.segments[:, 1], 9)), [-0.1, 0.1])


def test_clearance():
    builder = Builder()
    builder.line(0, 0, 10, 0)
    builder.pillar(5, 3, 0.5)
    points = np.array([[5.0, 1.0], [5.0, 2.0], [13.0, 4.0]])
    np.testing.assert_allclose(builder.world().clearance(points), [1.0, 0.5, 5.0])
