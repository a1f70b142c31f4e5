"""The options of a laser's mounting in the transforms of a recording (tf)."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class MountingOptions:
    """How far a laser may be from level and at rest."""

    tilt: float = math.radians(1.0)
    """Largest tilt of a laser that does not move, rad. A larger value accepts more recordings and worse
    scans."""
    rocking: float = math.radians(5.0)
    """Largest tilt of a laser that moves, rad: a stabiliser reports how the robot rocks. Beyond, it nods. A
    larger value accepts more recordings and worse scans."""
    turn: float = math.radians(1.0)
    """Largest rotation about the vertical from the mean, rad. Rocking by 5° both ways causes 0.4°. A larger
    value accepts more recordings and worse scans."""
    shift: float = 0.1
    """Largest horizontal shift from the mean, m. Rocking by 5° shifts a laser 1 m above its axis by 0.09 m. A
    larger value accepts more recordings and worse scans."""
    fixed_tolerance: float = 1e-6
    """A transform is fixed if its coordinates (m) and its quaternion change by no more. A larger value takes
    more lasers for fixed."""
