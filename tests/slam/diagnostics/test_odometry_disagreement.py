from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.poses import Array
from nscan_cli.slam.diagnostics.odometry_disagreement import odometry_disagreements
from nscan_cli.slam.diagnostics.options import OdometryDisagreementOptions

OPTIONS = OdometryDisagreementOptions()
EVERY = 4
"""Scans from keyframe to keyframe."""


def drive(steps: Array) -> Array:
    """Poses (S, 3) along a bow, with steps (S − 1,) in m."""
    angles = np.linspace(0.0, 2.0, len(steps) + 1)
    ways = steps[:, None] * np.stack([np.cos(angles[:-1]), np.sin(angles[:-1])], axis=1)
    return np.column_stack([np.vstack([np.zeros(2), np.cumsum(ways, axis=0)]), angles])


def found(odometry: Array, truth: Array, breaks: tuple[int, ...] = ()):
    rows = np.arange(0, len(truth), EVERY)
    return odometry_disagreements(rows, truth[rows], odometry, breaks, OPTIONS)


STEPS = np.full(400, 0.1)


@given(st.floats(0.65, 1.5), st.integers(0, 2**32 - 1))
def test_poor_odometry_is_no_disagreement(scale, seed):
    noise = 1.0 + 0.1 * np.random.default_rng(seed).standard_normal(len(STEPS))
    assert found(drive(scale * STEPS * np.clip(noise, 0.9, 1.1)), drive(STEPS)) == []


@pytest.mark.parametrize("factor", [0.0, 0.4, 2.5])
def test_the_stretch_that_is_too_short_or_too_long_is_found_with_both_lengths(factor):
    """The robot goes 10 m from row 100 to 200, and tracking says another way."""
    slipped = STEPS.copy()
    slipped[100:200] *= factor
    (stretch,) = found(drive(STEPS), drive(slipped))
    # A stretch that is partly sound counts, too.
    widest = OPTIONS.path / 0.1
    assert 100 - widest <= stretch.first <= 100 + EVERY
    assert 200 - EVERY <= stretch.last <= 200 + widest
    # 5 m of a bow of 20 m radius are longer than their chord by 1 − sin(0.125) / 0.125, 2.6 mm a metre.
    assert stretch.by_odometry == pytest.approx(0.1 * (stretch.last - stretch.first), rel=3e-3)
    less = stretch.by_odometry - stretch.by_scans
    assert less == pytest.approx(10 * (1 - factor), abs=3e-3 * max(stretch.by_odometry, stretch.by_scans))


def test_two_slips_far_apart_are_two():
    slipped = STEPS.copy()
    slipped[50:100] = slipped[300:350] = 0.0
    assert len(found(drive(STEPS), drive(slipped))) == 2


def test_over_a_break_nothing_is_compared():
    truth = drive(STEPS)
    carried = truth.copy()
    carried[202:, 0] += 30.0
    assert len(found(truth, carried)) == 1
    assert found(truth, carried, (202,)) == []


def test_who_goes_back_where_odometry_goes_on_has_not_come_as_far():
    """An odometry without the sign of the wheels' turn: the way is as long, but leads elsewhere."""
    there_and_back = np.zeros((101, 3))
    there_and_back[:, 0] = np.concatenate([np.arange(51), np.arange(49, -1, -1)]) * 0.1
    ahead = np.zeros((101, 3))
    ahead[:, 0] = np.arange(101) * 0.1
    (stretch,) = found(ahead, there_and_back)
    assert stretch.by_odometry == pytest.approx(0.1 * (stretch.last - stretch.first))
    assert stretch.first <= 50 <= stretch.last
    assert stretch.by_odometry - stretch.by_scans > OPTIONS.max_share * OPTIONS.path


def test_a_short_way_says_nothing():
    truth = drive(np.full(40, 0.1))
    assert found(truth, np.zeros_like(truth)) == []
    one = np.zeros((1, 3))
    assert found(one, one) == []
