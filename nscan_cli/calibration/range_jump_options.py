"""The parameters of the checks of scans that change from one to the next: of their scale, and their order."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class RangeJumpOptions:
    """When all ranges change by one factor from one scan to the next."""

    max_beams: int = 48
    """Approximate number of beams of a scan that are compared, evenly spread. More take longer."""
    min_beams: int = 20
    """Least number of beams of two scans that are compared. A larger value compares fewer scans."""
    min_factor: float = 1.03
    """Least factor between the ranges of two scans, or its inverse. A larger value finds less, and takes less
    time."""
    wrong_share: float = 0.5
    """Ranges are divided by their scale if its logarithm exceeds this share of that of `min_factor`. A larger
    value leaves more scans as they are."""
    tolerance: float = math.log(1.02)
    """Ranges have changed by the usual factor if the logarithm of theirs differs by less than this. A larger
    value matches more scans."""
    min_share: float = 0.2
    """Least share of beams whose range changed by the usual factor. A smaller value matches more scans."""
    max_beside: float = 0.75
    """The logarithms of the factors before and behind such a place are less than this share of its own:
    elsewhere odometry is wrong, or the laser sees little. A larger value matches more scans."""
    max_candidates: int = 48
    """Largest number of places at which scans are matched, those with the largest shares. More take
    longer."""
    min_gain: float = 0.2
    """The energy per point of four pairs of scans, one before the place and one behind, is lower by so much
    with the factor than without it, and that of two pairs on one side is higher. At 5 % it is lower by 0.3 to
    2 mostly. A larger value finds less."""
    max_misfit: float = 0.12
    """With the factor, the step across the place is off that by odometry by at most so much more than the
    steps beside it, m and rad. A larger value finds more."""
    max_off: float = 0.3
    """The four steps across the place agree with each other and with those beside it to so many metres. A
    larger value finds more."""
    max_turn_off: float = 0.1
    """The turns of these steps agree to so many rad. A larger value finds more."""
    refinement: float = math.log(1.01)
    """The factor is the minimum of a parabola through five energies this far apart, as a logarithm. A larger
    value finds more, and is less exact."""
    reach: int = 6
    """The middle of them is looked for so many times as far about the usual factor of the beams. A larger
    value finds more, and takes longer."""


@dataclass(frozen=True)
class OrderJumpOptions:
    """When the readings come in the other order from a scan on."""

    tolerance: float = 0.05
    """A beam agrees with a prediction if the logarithm of their ratio is less than this. A larger value
    matches other scans."""
    min_share_gain: float = 0.1
    """Scans are matched where so many more of the beams agree in the other order, as a share. A smaller value
    matches more scans."""
    max_candidates: int = 24
    """Largest number of places at which scans are matched, those with the largest gains. More take longer."""
    min_gain: float = 0.3
    """The energy per point of four pairs of scans, one before the place and one behind, is lower by so much
    if one is mirrored, and that of two pairs on one side is higher. A larger value finds less."""
    largest_turn: float = 1.2
    """Without odometry, scans are also matched after turns of the robot up to this angle, rad. With a larger
    one scans of faster turns keep their order."""
    turn_step: float = 0.4
    """Interval between these turns, rad, and between those all around after which a laser that was turned on
    the robot would match. A smaller one takes longer."""
    max_misfit: float = 0.8
    """Without odometry, the steps by these pairs agree to so many metres. A larger value finds more."""
    max_turn_misfit: float = 0.2
    """Without odometry, the turns by these pairs agree to so much, rad. A larger value finds more."""


@dataclass(frozen=True)
class BearingJitterOptions:
    """When first directions jitter in the file alone."""

    min_jitter: float = math.radians(0.5)
    """Least usual change of the first direction from one scan to the next, rad. A smaller value checks more
    logs."""
    sigmas: float = 2.5
    """The share of such changes by which turns by scans and by odometry differ exceeds one half by so many
    standard deviations. A larger value finds less."""
