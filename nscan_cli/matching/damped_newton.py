"""Control of damped Newton steps, after Levenberg and Marquardt: damping, acceptance, and the last step.

The solvers of pairwise matches, of joint matches, of graphs, and of paths in uneven motion share it. Each
adds damping · diag H to its Hessian.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import leaf_kernel


class StepControl(NamedTuple):
    """The limits of a solver."""

    first: float
    """Damping of the first step."""
    least: float
    """Lower bound of the damping."""
    least_divided: float
    """After an accepted step, damping above this is lowered, and damping up to this becomes `least`."""
    least_raised: float
    """Lower bound of the damping after a rejected step."""
    greatest: float
    """The solver gives up when the damping exceeds this."""
    trusted: float
    """A step with damping up to this is the last one if it is within the tolerance. With more damping it may
    be short only because it is damped."""
    damped_share: float
    """A step with more damping than `trusted` is the last one if it is within this share of the tolerance."""
    rounding: float
    """A step that increases the value by less than this share is accepted, since that is rounding."""
    greatest_stretch: float = 1.0
    """A step is made longer at most by this factor."""
    unstretched: int = 0
    """Number of iterations before any step is made longer."""
    raised: float = 10.0
    """Factor of the damping after a rejected step. A larger value comes to short steps sooner."""
    lowered: float = 0.1
    """Factor of the damping after an accepted step. A larger value keeps steps damped for longer."""
    floor: float = 0.0
    """Added to the diagonal of the damped Hessian, for directions without information. A larger value makes
    steps there shorter."""
    floor_share: float = 0.0
    """The same, as a share of the greatest element of the diagonal."""


PAIRWISE_STEPS = StepControl(
    first=1e-3, least=1e-7, least_divided=1e-7, least_raised=0.0,
    greatest=1e6, trusted=1e-3, damped_share=0.1, rounding=0.0, floor=1e-12,
)  # fmt: skip
"""Starts are rough, so steps are damped from the first on. One NDT is cheap to evaluate, so a damping up to
1e6 allows long searches where the energy jumps at borders of cells. Paths in uneven motion take these steps,
too, without the floor."""
JOINT_STEPS = StepControl(
    first=1e-3, least=1e-8, least_divided=1e-8, least_raised=0.0,
    greatest=1e4, trusted=np.inf, damped_share=0.0, rounding=0.0,
    greatest_stretch=4.0, unstretched=5, floor=1e-12, floor_share=1e-9,
)  # fmt: skip
"""An evaluation costs n (n − 1) times as much. So the solver gives up earlier, and any step within the
tolerance is the last one. In bare corridors steps with the semi-definite part of the Hessian are several
times too short again and again. Then they are made longer."""
GRAPH_STEPS = StepControl(
    first=0.0, least=0.0, least_divided=1e-9, least_raised=1e-6,
    greatest=1e8, trusted=1.0, damped_share=0.0, rounding=1e-12, floor_share=1e-9,
)  # fmt: skip
"""The energy is smooth and nearly quadratic, so steps are undamped unless they fail. Sums over thousands of
relations carry rounding errors. The floor of the diagonal is damped as the diagonal is."""


@leaf_kernel
def is_accepted(value: float, trial: float, control: StepControl) -> bool:
    """Whether a step from an objective's `value` to its `trial` value is taken."""
    return trial <= value + control.rounding * abs(value)


@leaf_kernel
def next_damping(damping: float, accepted: bool, control: StepControl) -> float:
    """The damping after a step that was accepted or rejected."""
    if not accepted:
        return max(control.raised * damping, control.least_raised)
    return max(control.lowered * damping, control.least) if damping > control.least_divided else control.least


@leaf_kernel
def next_stretch(slope: float, stretch: float, gain: float, control: StepControl) -> float:
    """The factor that makes the next step as long as the last one shows that it has to be; 1 or more.

    The last step was made longer by `stretch`, and lowered the objective by `gain`; `slope` is −gᵗ Δp of the
    step before that. The parabola with this slope and gain has its minimum where the factor is slope by
    curvature. The Hessian of the step expected it at 1.
    """
    if gain <= 0.0:
        return 1.0
    curvature = 2.0 * (stretch * slope - gain) / (stretch * stretch)
    if control.greatest_stretch * curvature <= slope:
        return control.greatest_stretch
    return max(1.0, slope / curvature)


@leaf_kernel
def is_last(length: float, tolerance: float, damping: float, control: StepControl) -> bool:
    """Whether a step is within the tolerance, so that the solver has converged.

    `length` is the greatest change of a variable (m, rad), `damping` that of the step.
    """
    return length < (tolerance if damping <= control.trusted else control.damped_share * tolerance)
