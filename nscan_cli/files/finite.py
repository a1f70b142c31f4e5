"""A check before writing: nan and infinity must not get into a file."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


class NotFiniteError(ValueError):
    """A result has a number that is not finite, which is a bug. In a file it would go unnoticed."""


def check_finite(what: str, *values: ArrayLike | None) -> None:
    """Raises NotFiniteError if a value is nan or infinite; `what` names the values in the message."""
    for value in values:
        if value is not None and not np.isfinite(value).all():
            raise NotFiniteError(f"{what}: a number is not finite, and nothing is written")
