"""Interlaced scans: the beams of every other scan of a SICK LMS lie between those of the scan before.

Such a log has scans of 181 and of 180 readings, a degree apart. The record gives the same first direction for
both, but the 180 beams lie between the 181: they begin half a step later. Read as recorded, every other scan
would be turned by half a degree, and scan matching would follow it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.poses import Array, Indices, Mask


@dataclass(frozen=True)
class InterlacedOptions:
    """When scans of a CARMEN log are interlaced."""

    min_beams: int = 90
    """Least number of readings of the longer scans. A larger value finds fewer logs."""
    min_share: float = 0.05
    """Least share of the log that both kinds of scans have. A larger value finds fewer logs."""
    same: float = 1e-3
    """Largest difference of equal directions and steps, as a share of the step. A larger value finds more."""


def between_the_others(
    beams: Indices, first: Array, step: Array, options: InterlacedOptions = InterlacedOptions()
) -> Mask:
    """(S,) which scans have their beams between those of the others.

    `beams` (S,) are the numbers of readings, `first` and `step` (S,) the first direction and the step that
    the log says, rad.
    """
    most = int(beams.max(initial=0))
    short, whole = beams == most - 1, beams == most
    shares = min(short.mean(), whole.mean())
    if most < options.min_beams or shares < options.min_share or not (short | whole).all():
        return np.zeros(len(beams), dtype=np.bool_)
    is_same = max(np.ptp(first), np.ptp(step)) <= options.same * abs(step[0])
    return short if is_same else np.zeros(len(beams), dtype=np.bool_)
