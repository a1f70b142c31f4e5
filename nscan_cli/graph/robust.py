"""Which relations contradict all others, by graduated non-convexity.

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


def contradicting(energy: GraphEnergy, poses: Array, doubted: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of the doubted relations (R,) contradict the others; `poses` (K, 3) are at the energy's optimum.

    The relations are in the energy's order. Nothing is done when all are within the bound already. A
    relation of n scans is judged by its χ² for 3 (n − 1) degrees of freedom, by three.
    """
    chi2 = chi2_by_three(energy, poses)
    narrow = float(chi2[doubted].max(initial=0.0)) / BOUND
    if narrow <= 1.0:
        return np.zeros(len(doubted), dtype=np.bool_)
    weights = np.ones(len(doubted))
    while narrow > 1.0:
        narrow = max(narrow / NARROWING, 1.0)
        weights[doubted] = (narrow * BOUND / (narrow * BOUND + chi2[doubted])) ** 2
        weighted = energy.weighted(weights)
        poses = optimise(weighted, poses, STEPS, 1e-4).poses
        chi2 = chi2_by_three(energy, poses)
    return doubted & (weights < LEAST_WEIGHT)


def chi2_by_three(energy: GraphEnergy, poses: Array) -> Array:
    """(R,) χ² of every relation at the poses (K, 3) for three degrees of freedom."""
    sizes = np.diff(energy.columns.starts)
    chi2: Array = energy.terms(poses) / (sizes - 1)
    return chi2
