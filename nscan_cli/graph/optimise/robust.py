"""Which relations contradict all others, and a way out of a local minimum, by graduated non-convexity.

Yang, Antonante, Tzoumas, Carlone, "Graduated Non-Convexity for Robust Spatial Perception", RA-L 2020: a
relation that may be wrong counts by the kernel of Geman and McClure, which begins so wide that the energy is
all but convex, and narrows to its bound.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.graph.optimise.graph_energy import GraphEnergy
from nscan_cli.graph.optimise.graph_solver import optimise
from nscan_cli.poses import Array

RARE, USUAL = 3.09, 1.645
"""Standard deviations of a normal number: its 99.9 % and 95 % quantiles, which those of χ² are made of."""
BOUND = 3.0
"""Relations contradict the others beyond so many times the 99.9 % quantile of their χ²: those that share
scans are not as independent as they would have to be."""
NARROWING = 1.4
"""Factor from one width of the kernel to the next."""
STEPS = 5
"""Newton steps at each width."""
EASED_NARROWING, EASED_STEPS = 1.2, 10
"""On the way out of a fold, where all relations are doubted."""
MOST_WIDTHS = 12
"""A kernel that begins so wide that it would take more than this narrows faster."""


def contradicting(energy: GraphEnergy, poses: Array, doubted: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of the doubted relations (R,) contradict the others; `poses` (K, 3) are at the energy's optimum.

    The relations are in the energy's order. Nothing is done when all are within the bound already. Of one of
    n scans χ² has 3 (n − 1) degrees of freedom.
    """
    bounds = BOUND * chi2_quantiles(energy, RARE)
    narrowed = _graduated(energy, poses, doubted, bounds, NARROWING, STEPS)
    if narrowed is None:
        return np.zeros(len(doubted), dtype=np.bool_)
    # At the poses that the last weights have led to, not those that these were made from.
    return doubted & (energy.terms(narrowed) > bounds)


def eased(energy: GraphEnergy, poses: Array) -> Array | None:
    """Another start (K, 3) where a graph at `poses` (K, 3) may be folded wrong; None where all relations fit.

    In a local minimum most relations bend a little, and a few a lot. Here those that fit least lose their
    say, so that the others unbend; poses that all relations agree on are found again from there. All fit
    where the χ² of each is below its 95 % quantile.
    """
    all_of_them = np.ones(len(energy.columns.fixed), dtype=np.bool_)
    bounds = chi2_quantiles(energy, USUAL)
    return _graduated(energy, poses, all_of_them, bounds, EASED_NARROWING, EASED_STEPS)


def _graduated(
    energy: GraphEnergy,
    poses: Array,
    doubted: NDArray[np.bool_],
    bounds: Array,
    narrowing: float,
    steps: int,
) -> Array | None:
    """The poses (K, 3) when the kernel of the doubted relations (R,) has narrowed to their bounds (R,).

    None where all are within these already, and where a χ² is beyond all numbers.
    """
    weights, excess = np.ones(len(doubted)), energy.terms(poses) / bounds
    narrow = float(excess[doubted].max(initial=0.0))
    if not 1.0 < narrow < np.inf:
        return None
    narrowing = max(narrowing, narrow ** (1 / MOST_WIDTHS))
    while narrow > 1.0:
        narrow = max(narrow / narrowing, 1.0)
        weights[doubted] = (narrow / (narrow + excess[doubted])) ** 2
        poses = optimise(energy.weighted(weights), poses, steps, 1e-4).poses
        excess = energy.terms(poses) / bounds
    return poses


def chi2_quantiles(energy: GraphEnergy, deviations: float) -> Array:
    """(R,) the quantile of every relation's χ² that is so many standard deviations of a normal number.

    By E. B. Wilson, M. M. Hilferty, "The Distribution of Chi-Square", 1931: within 2 % for three degrees of
    freedom, and closer for more.
    """
    freedom = 3.0 * (np.diff(energy.columns.starts) - 1)
    spread = 2 / (9 * freedom)
    quantiles: Array = freedom * (1 - spread + deviations * np.sqrt(spread)) ** 3
    return quantiles


def chi2_by_three(energy: GraphEnergy, poses: Array) -> Array:
    """(R,) χ² of every relation at the poses (K, 3) for three degrees of freedom."""
    sizes = np.diff(energy.columns.starts)
    chi2: Array = energy.terms(poses) / (sizes - 1)
    return chi2
