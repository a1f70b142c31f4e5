"""A value that the scans determine, with its standard deviation, or the reason why they leave it open."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Estimate:
    """A value by the scans."""

    value: float
    sigma: float
    """Standard deviation; inf where the drive leaves the value open."""
    recorded: float | None = None
    """The value that the file, or an option, says; None if they say nothing."""
    why_open: str = ""
    """Why the drive leaves it open, in words; empty if it does not."""

    @property
    def is_open(self) -> bool:
        """Whether the drive leaves the value open."""
        return not np.isfinite(self.sigma)


def estimate(value: float, sigma: float, recorded: float | None, why_open: str) -> Estimate:
    """An estimate; where `sigma` is inf, the drive leaves the value open, for the reason `why_open`."""
    return Estimate(value, sigma, recorded, "" if np.isfinite(sigma) else why_open)


def left_open(value: float, recorded: float | None, why: str) -> Estimate:
    """A value that the drive leaves open; `value` is what holds then."""
    return Estimate(value, np.inf, recorded, why)
