"""Which relations contradict all others, and a way out of a local minimum, by graduated non-convexity.

Yang, Antonante, Tzoumas, Carlone, "Graduated Non-Convexity for Robust Spatial Perception", RA-L 2020: a
relation that may be wrong counts by the kernel of Geman and McClure, which begins so wide that the energy is
all but convex, and narrows to its bound.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.graph.optimise import optimise
from nscan_cli.graph.system import GraphEnergy
from nscan_cli.poses import Array

BOUND = 50.0
"""χ² of three degrees of freedom: three times the 99.9 % quantile, for relations that share scans are not
as independent as they would have to be."""
NARROWING = 1.4
"""Factor from one width of the kernel to the next."""
STEPS = 5
"""Newton steps at each width."""
LEAST_WEIGHT = 0.25
"""What a relation at the bound weighs."""
FITS = 7.8
"""χ² of three degrees of freedom: its 95 % quantile. In a graph that is folded wrong some have more."""
EASED_NARROWING, EASED_STEPS = 1.2, 10
"""On the way out of a fold, where all relations are doubted."""


def contradicting(energy: GraphEnergy, poses: Array, doubted: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of the doubted relations (R,) contradict the others; `poses` (K, 3) are at the energy's optimum.

    The relations are in the energy's order. Nothing is done when all are within the bound already. A
    relation of n scans is judged by its χ² for 3 (n − 1) degrees of freedom, by three.
    """
    weights, _ = _graduated(energy, poses, doubted, BOUND, NARROWING, STEPS)
    return doubted & (weights < LEAST_WEIGHT)


def eased(energy: GraphEnergy, poses: Array) -> Array | None:
    """Another start (K, 3) where a graph at `poses` (K, 3) may be folded wrong; None where all relations fit.

    In a local minimum most relations bend a little, and a few a lot. Here those that fit least lose their
    say, so that the others unbend; poses that all relations agree on are found again from there.
    """
    all_of_them = np.ones(len(energy.columns.fixed), dtype=np.bool_)
    weights, eased_poses = _graduated(energy, poses, all_of_them, FITS, EASED_NARROWING, EASED_STEPS)
    return None if (weights == 1.0).all() else eased_poses


def _graduated(
    energy: GraphEnergy,
    poses: Array,
    doubted: NDArray[np.bool_],
    bound: float,
    narrowing: float,
    steps: int,
) -> tuple[Array, Array]:
    """The weights (R,) of the relations when the kernel has narrowed to the bound, and the poses (K, 3)."""
    weights, chi2 = np.ones(len(doubted)), chi2_by_three(energy, poses)
    narrow = float(chi2[doubted].max(initial=0.0)) / bound
    while narrow > 1.0:
        narrow = max(narrow / narrowing, 1.0)
        weights[doubted] = (narrow * bound / (narrow * bound + chi2[doubted])) ** 2
        poses = optimise(energy.weighted(weights), poses, steps, 1e-4).poses
        chi2 = chi2_by_three(energy, poses)
    return weights, poses


def chi2_by_three(energy: GraphEnergy, poses: Array) -> Array:
    """(R,) χ² of every relation at the poses (K, 3) for three degrees of freedom."""
    sizes = np.diff(energy.columns.starts)
    chi2: Array = energy.terms(poses) / (sizes - 1)
    return chi2
