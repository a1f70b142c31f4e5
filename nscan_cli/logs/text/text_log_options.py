"""The options of reading text logs: which of their numbers are plausible, and how they are rounded."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from nscan_cli.logs.heading_unit import HeadingUnitOptions


@dataclass(frozen=True)
class TextLogOptions:
    """What numbers in the records of text logs may be."""

    max_mount: float = 1e3
    """A mounting in PARAM with a value of this size or more is ignored, m and rad. A larger value believes
    more."""
    mount_difference: float = 0.01
    """Largest difference of two mountings in one log that a warning does not name, m. A larger value warns
    less."""
    mount_turn_difference: float = math.radians(0.5)
    """Largest difference of the angles of two mountings in one log that a warning does not name, rad. A
    larger value warns less."""
    max_decimals: int = 6
    """Largest number of decimals that bearings are written with. A larger number rounds less."""
    max_unevenness: float = 0.05
    """Largest distance of a bearing from its even place, beyond rounding, in steps. A larger value accepts
    less even bearings."""
    max_bearing: float = 720.0
    """Records with a larger bearing are skipped, in degrees or rad as written. A larger value skips less."""
    first_bearing: float = math.radians(-1.0)
    """Bearings that begin beyond this and end near `last_bearing` are likely counted from the side, rad: a
    warning says so. A larger value warns less."""
    last_bearing: float = math.radians(180.0)
    """Where bearings end that are counted from the side, rad. With a larger value the warning is for lasers
    with a wider view."""
    last_bearing_tolerance: float = math.radians(30.0)
    """Largest distance of the last bearing from `last_bearing`, rad. A larger value warns more."""
    beside_degrees: HeadingUnitOptions = field(
        default_factory=lambda: HeadingUnitOptions(min_steps=2, min_along=0.0, min_gain=0.0)
    )
    """When headings are in degrees where bearings are. They likely are, too: any way that is rather along
    them tells it."""
