"""Statistics of errors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nscan_cli.poses import Array


@dataclass(frozen=True)
class Spread:
    """Statistics of a set of errors, in their unit."""

    mean: float
    sd: float
    """Sample standard deviation (n − 1); 0 for a single error."""
    median: float
    mean_square: float
    """In the unit squared."""
    rmse: float
    """Root of the mean square."""
    max: float

    @classmethod
    def of(cls, errors: Array) -> Spread:
        """The statistics of errors (n,), n ≥ 1."""
        mean_square = float((errors**2).mean())
        return cls(
            mean=float(errors.mean()),
            sd=float(errors.std(ddof=1)) if len(errors) > 1 else 0.0,
            median=float(np.median(errors)),
            mean_square=mean_square,
            rmse=math.sqrt(mean_square),
            max=float(errors.max()),
        )
