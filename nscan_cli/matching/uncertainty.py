"""What the Hessian at a match says about its uncertainty."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.poses import Array

SINGULAR = 1e-10
"""An eigenvalue below this share of the greatest is no information, but rounding."""

SETTLED_DEVIATIONS = 0.5
SETTLED_STEP = 0.01
"""m, rad; half of the least standard deviation of a Gaussian."""
WEAK_SIGMA = 0.05
"""m; a scan that is held with a larger standard deviation in some direction is held weakly. In rooms it is
0.003 to 0.015, in a corridor without any doors about 0.1."""


class Weakest(NamedTuple):
    """The direction of translation that a match knows least, whatever the rotation is."""

    direction: float
    """Angle of the direction in the frame of the reference, rad in (−π/2, π/2]."""
    sigma: float | None
    """Standard deviation (m) along it; None when nothing holds the scan there."""

    @property
    def is_weak(self) -> bool:
        """Whether it is worth a word: a corridor, or less."""
        return self.sigma is None or self.sigma > WEAK_SIGMA


def covariance_of(information: Array) -> Array | None:
    """The inverse of an information matrix (m, m); None when that is not positive definite."""
    eigenvalues, vectors = np.linalg.eigh(information)
    if not eigenvalues[0] > SINGULAR * eigenvalues[-1]:
        return None
    covariance: Array = (vectors / eigenvalues) @ vectors.T
    return covariance


def decrement(gradient: Array, covariance: Array) -> float:
    """√(gᵗ H⁻¹ g): the Newton step that is left at a point, counted in standard deviations."""
    return float(np.sqrt(gradient @ covariance @ gradient))


def is_settled(gradient: Array, covariance: Array) -> bool:
    """Whether the Newton step that is left at a point is nothing: against the uncertainty, or at all."""
    step = covariance @ gradient
    return decrement(gradient, covariance) <= SETTLED_DEVIATIONS or bool(np.abs(step).max() <= SETTLED_STEP)


def weakest_translation(information: Array) -> Weakest:
    """The weakest direction of the translation of a pose with an information matrix (3, 3).

    Metres and radians do not compare, so the rotation is eliminated first (Schur complement): what is
    left is the information on the translation alone.
    """
    translation, coupling, rotation = information[:2, :2], information[:2, 2], information[2, 2]
    if rotation > 0.0:
        translation = translation - np.outer(coupling, coupling) / rotation
    eigenvalues, vectors = np.linalg.eigh(translation)
    # Of the two ways along an axis, the one ahead.
    x, y = vectors[:, 0] if vectors[0, 0] > 0.0 else -vectors[:, 0]
    direction = float(np.arctan2(y, x)) if x > 0.0 else np.pi / 2
    known = eigenvalues[0] > SINGULAR * eigenvalues[1]
    return Weakest(direction, float(eigenvalues[0] ** -0.5) if known else None)
