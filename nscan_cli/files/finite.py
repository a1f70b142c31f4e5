"""The border to files: no number that is none gets into one."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


class NotFiniteError(ValueError):
    """A result that has a number that is none, which is a bug: it would go unnoticed in a file."""


def check_finite(what: str, *values: ArrayLike | None) -> None:
    """Raises NotFiniteError when one of the values, which `what` names, is nan or infinite."""
    for value in values:
        if value is not None and not np.isfinite(value).all():
            raise NotFiniteError(f"{what}: a number is not finite, and nothing is written")
