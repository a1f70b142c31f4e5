"""Where tracking may have slipped, as odometry tells."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.poses import Array, compose
from nscan_cli.slam.loop_closure.options import LoopClosureOptions
from nscan_cli.slam.loop_closure.slip_evidence import SlipEvidence

STEP = np.array([1.5, 0.1, 0.2])
NONE = np.full(3, np.nan)
OPTIONS = LoopClosureOptions()


def evidence(noise: float, steps: int = 200) -> SlipEvidence:
    """After some steps of 1.5 m whose coordinates and angle differ by `noise` (m and rad)."""
    found, rng = no_evidence(), np.random.default_rng(1)
    for _ in range(steps):
        found.variances(STEP, odometry(rng.normal(0.0, noise, 3)), 1.5)
    return found


def no_evidence() -> SlipEvidence:
    return SlipEvidence(OPTIONS)


def odometry(off: Array, step: Array = STEP) -> Array:
    """What odometry says of a step where tracking differs from it by `off` (3,)."""
    by_odometry: Array = compose(step, -np.asarray(off))
    return by_odometry


def test_a_step_far_off_the_odometry_may_be_anywhere_between_both():
    """Golden: a uniform distribution over 0.6 m has 0.6² / 3 about its end; each coordinate has half."""
    place, angle = evidence(0.01).variances(STEP, odometry(np.array([0.6, 0.0, 0.0])), 1.5)
    assert place == pytest.approx(0.5 * 0.6**2 / 3)
    assert angle == 0.0
    place, angle = evidence(0.01).variances(STEP, odometry(np.array([0.0, 0.0, 0.3])), 1.5)
    assert angle == pytest.approx(0.3**2 / 3)


def test_a_usual_difference_is_no_slip():
    """Bad odometry differs from tracking at every step, and tells nothing of it."""
    good, bad = evidence(0.01), evidence(0.2)
    off = np.array([0.15, 0.15, 0.15])
    assert min(good.variances(STEP, odometry(off), 1.5)) > 0.0
    assert bad.variances(STEP, odometry(off), 1.5) == (0.0, 0.0)


def test_nothing_is_told_before_the_usual_difference_is_known_or_without_odometry():
    early, off = evidence(0.01, steps=OPTIONS.min_compared_steps - 2), np.array([0.6, 0.0, 0.0])
    assert early.variances(STEP, odometry(off), 1.5) == (0.0, 0.0)
    assert evidence(0.01).variances(STEP, NONE, 1.5) == (0.0, 0.0)
    assert evidence(0.01).variances(STEP, odometry(off), 0.0) == (0.0, 0.0)


def test_turns_are_compared_across_the_jump_of_the_angle():
    near = np.array([0.0, 0.0, 2 * np.pi])
    assert evidence(0.01).variances(STEP, STEP + near, 1.5) == (0.0, 0.0)


def test_turns_are_compared_with_turns():
    """Wheels that slip in turns tell of no slip of tracking there; mit-killian was searched everywhere."""
    found, rng = no_evidence(), np.random.default_rng(2)
    turn, off = np.array([1.2, 0.4, 0.8]), np.array([0.0, 0.0, 0.3])
    for _ in range(100):
        found.variances(STEP, odometry(rng.normal(0.0, 0.01, 3)), 1.5)
        found.variances(turn, odometry(rng.normal(0.0, (0.01, 0.01, 0.3)), turn), 1.5)
    assert found.variances(turn, odometry(off, turn), 1.5)[1] == 0.0
    assert found.variances(STEP, odometry(off), 1.5)[1] > 0.0
    assert found.variances(turn, odometry(np.array([0.0, 0.0, 1.5]), turn), 1.5)[1] > 0.0
