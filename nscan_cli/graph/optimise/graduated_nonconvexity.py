"""Which relations contradict all others, and a way out of a local minimum, by graduated non-convexity.

Yang, Antonante, Tzoumas, Carlone, "Graduated Non-Convexity for Robust Spatial Perception", RA-L 2020: each
doubted relation counts by the kernel of Geman and McClure. The kernel begins so wide that the energy is
nearly convex, and narrows to the relation's bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.graph.optimise.graph_solver import StopOptions, optimise_poses
from nscan_cli.poses import Array, Mask


@dataclass(frozen=True)
class RobustOptions:
    """Bounds and steps of graduated non-convexity. The defaults are for loops that may be wrong."""

    tail_probability: float = 0.001
    """A relation fits if its χ² is below the quantile that χ² exceeds with this probability. A larger value
    doubts more relations."""
    bound_factor: float = 3.0
    """The quantile is multiplied by this, since relations that share scans are not independent, as χ²
    assumes. A larger value doubts fewer relations."""
    narrowing: float = 1.4
    """Factor from one width of the kernel to the next. A larger value takes fewer and coarser steps."""
    iterations: int = 5
    """Most Newton steps at each width. More steps follow the minimum more closely and take longer."""
    tolerance: float = 1e-4
    """The steps at a width end with one below this, m and rad. A larger one ends them earlier."""
    max_widths: int = 12
    """Largest number of widths. Where the first width would need more, the narrowing is larger. A larger
    number takes longer on graphs that fit badly."""


def contradicting(energy: GraphEnergy, poses: Array, doubted: Mask, options: RobustOptions) -> Mask:
    """Which of the doubted relations (R,) contradict the others; `poses` (K, 3) are at the energy's optimum.

    The relations are in the energy's order. None contradicts where all are within their bounds at the poses.
    """
    bounds = chi2_bounds(energy, options)
    robust_poses = _graduated(energy, poses, doubted, bounds, options)
    if robust_poses is None:
        return np.zeros(len(doubted), dtype=np.bool_)
    # At the poses that the last weights have led to, not those that these were made from.
    return doubted & (energy.terms(robust_poses) > bounds)


def unfolded(energy: GraphEnergy, poses: Array, options: RobustOptions) -> Array | None:
    """Another start (K, 3) where a graph at `poses` (K, 3) may be in a local minimum; None where all fit.

    In a local minimum most relations are off a little, and a few a lot. The relations that fit least lose
    their weight, so that the others recover. From there, the poses that all relations agree on are found.
    """
    every = np.ones(len(energy.columns.fixed), dtype=np.bool_)
    return _graduated(energy, poses, every, chi2_bounds(energy, options), options)


def _graduated(
    energy: GraphEnergy, poses: Array, doubted: Mask, bounds: Array, options: RobustOptions
) -> Array | None:
    """The poses (K, 3) when the kernel of the doubted relations (R,) has narrowed to their bounds (R,).

    None where all are within these already, and where a χ² is not finite.
    """
    weights, excess = np.ones(len(doubted)), energy.terms(poses) / bounds
    width = float(excess[doubted].max(initial=0.0))
    if not 1.0 < width < np.inf:
        return None
    narrowing = max(options.narrowing, width ** (1 / options.max_widths))
    stop = StopOptions(options.iterations, options.tolerance)
    while width > 1.0:
        width = max(width / narrowing, 1.0)
        weights[doubted] = (width / (width + excess[doubted])) ** 2
        poses = optimise_poses(energy.weighted(weights), poses, stop).poses
        excess = energy.terms(poses) / bounds
    return poses


def chi2_bounds(energy: GraphEnergy, options: RobustOptions) -> Array:
    """(R,) the bound on the χ² of each relation; one of n scans has 3 (n − 1) degrees of freedom."""
    from scipy.special import chdtri

    freedom = 3.0 * (np.diff(energy.columns.starts) - 1)
    return options.bound_factor * np.asarray(chdtri(freedom, options.tail_probability), np.float64)


def chi2_by_three(energy: GraphEnergy, poses: Array) -> Array:
    """(R,) χ² of every relation at the poses (K, 3), scaled to three degrees of freedom."""
    sizes = np.diff(energy.columns.starts)
    chi2: Array = energy.terms(poses) / (sizes - 1)
    return chi2
