"""The uncertainty of a match from its Hessian. It serves pairwise and joint matches alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nscan_cli.poses import Array

INDEFINITE = "the Hessian is not positive definite"
CELL_BORDER = "stopped at a cell border, where the energy jumps"
SINGULAR = 1e-10
"""An eigenvalue below this share of the greatest one is rounding, not information."""


@dataclass(frozen=True)
class ConvergenceOptions:
    """The Newton step that may be left at a minimum. One of the bounds has to hold."""

    deviations: float = 0.5
    """Greatest length of the step, in standard deviations. With a larger value more matches count as
    converged."""
    step: float = 0.01
    """Greatest component of the step, m and rad: half of the least standard deviation of a Gaussian. With a
    larger value more matches count as converged."""


class Weakest(NamedTuple):
    """The direction of translation in which a match is least certain, with the rotation unknown."""

    direction: float
    """Angle of the direction in the frame of the reference, rad in (−π/2, π/2]."""
    sigma: float | None
    """Standard deviation along it, m; None when the match has no information there."""
    is_weak: bool
    """Whether the user should know it: as in a corridor, or worse."""


def covariance_of(information: Array) -> Array | None:
    """The inverse of an information matrix (m, m); None when that is not positive definite."""
    return covariances_of(information[None])[0]


def covariances_of(information: Array) -> list[Array | None]:
    """The `covariance_of` each of n information matrices (n, m, m)."""
    eigenvalues, vectors = np.linalg.eigh(information)
    found: list[Array | None] = [None] * len(information)
    definite = np.flatnonzero(eigenvalues[:, 0] > SINGULAR * eigenvalues[:, -1])
    vectors = vectors[definite]
    covariances = (vectors / eigenvalues[definite, None]) @ vectors.swapaxes(-1, -2)
    for each, covariance in zip(definite.tolist(), covariances, strict=True):
        found[each] = covariance
    return found


def decrement(gradient: Array, covariance: Array) -> float:
    """√(gᵗ H⁻¹ g): the length of the Newton step at a point, in standard deviations."""
    return float(np.sqrt(gradient @ covariance @ gradient))


def why_no_minimum(gradient: Array, covariance: Array | None, options: ConvergenceOptions) -> str | None:
    """Why a point is no minimum; None if the Newton step is short, in deviations or in m and rad."""
    if covariance is None:
        return INDEFINITE
    short = np.abs(covariance @ gradient).max() <= options.step
    return None if short or decrement(gradient, covariance) <= options.deviations else CELL_BORDER


def weakest_translation(information: Array, weak_sigma: float) -> Weakest:
    """The weakest direction of the translation of a pose with an information matrix (3, 3).

    It is weak if its standard deviation exceeds `weak_sigma` (m). Metres and radians do not compare, so the
    rotation is eliminated first (Schur complement).
    """
    translation, coupling, rotation = information[:2, :2], information[:2, 2], information[2, 2]
    if rotation > 0.0:
        translation = translation - np.outer(coupling, coupling) / rotation
    eigenvalues, vectors = np.linalg.eigh(translation)
    # Of the two directions along an axis, the one with x > 0.
    x, y = vectors[:, 0] if vectors[0, 0] > 0.0 else -vectors[:, 0]
    direction = float(np.arctan2(y, x)) if x > 0.0 else np.pi / 2
    sigma = float(eigenvalues[0] ** -0.5) if eigenvalues[0] > SINGULAR * eigenvalues[1] else None
    return Weakest(direction, sigma, sigma is None or sigma > weak_sigma)
