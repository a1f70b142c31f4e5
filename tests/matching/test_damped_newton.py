"""The step control of the solvers."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nscan_cli.matching.damped_newton import GRAPH_STEPS, JOINT_STEPS, PAIRWISE_STEPS, next_stretch


@given(slope=st.floats(1e-6, 1e6), share=st.floats(0.3, 1.0), stretch=st.floats(1.0, 4.0))
def test_a_step_is_stretched_to_the_minimum_of_the_parabola(slope, share, stretch):
    # The objective falls by t · slope − ½ t² c, with a curvature c that is a share of what the step expects.
    curvature = share * slope
    gain = stretch * slope - 0.5 * stretch * stretch * curvature
    if gain > 0.0:
        assert next_stretch(slope, stretch, gain, JOINT_STEPS) == pytest.approx(1 / share, rel=1e-6)


def test_a_step_is_stretched_within_bounds():
    # Straight down, even bent downwards; steeper than expected; a step that gained nothing.
    assert next_stretch(1.0, 1.0, 1.0, JOINT_STEPS) == JOINT_STEPS.greatest_stretch
    assert next_stretch(1.0, 1.0, 1.5, JOINT_STEPS) == JOINT_STEPS.greatest_stretch
    assert next_stretch(1.0, 1.0, 0.1, JOINT_STEPS) == 1.0
    assert next_stretch(1.0, 4.0, -0.1, JOINT_STEPS) == 1.0


@pytest.mark.parametrize("control", [PAIRWISE_STEPS, GRAPH_STEPS])
def test_other_solvers_stretch_nothing(control):
    assert next_stretch(1.0, 1.0, 1.0, control) == 1.0
