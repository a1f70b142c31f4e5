"""The parameters of the search for what goes along with the robot."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class CompanionOptions:
    """When something goes along with the robot: readings that end where the robot itself has been or will be.

    Such readings are in 72 to 98 % of the scans with a cart or a follower, in 8 % at most on real logs.
    """

    scans: int = 100
    """Number of scans that are checked, evenly spread. More take longer."""
    first_of: int = 6
    """One in so many of these is checked first. A larger value takes less time."""
    clear_share: float = 0.1
    """The others are not checked if a smaller share of these has such readings. A smaller value takes
    longer."""
    max_beams: int = 180
    """Approximate number of beams of a scan that are checked, evenly spread. More take longer."""
    min_way: float = 5.0
    """Shortest path of a drive that is checked, m. A larger value skips longer logs."""
    longest_step: float = 1.0
    """Longest step between two scans of one path, m: beyond it the robot was carried or lost. A larger value
    joins more of such parts."""
    nearest: float = 0.25
    """Readings are compared with the path from this distance on, before and behind the robot, m. A larger
    value misses what is near."""
    farthest: float = 4.0
    """Readings are compared with the path up to this distance along it, before and behind the robot, m. A
    larger value finds more, also where drift of odometry has put a wall onto the path."""
    path_step: float = 0.05
    """Distance between the points of the path that are compared, m. A smaller value takes longer."""
    clearance: float = 0.2
    """Points of the path nearer to the robot than this are not compared, m: the robot is there now. A larger
    value misses what is near."""
    max_range: float = 1.5
    """Longest reading that is compared, m. A larger value finds who follows farther away, where he does less
    harm."""
    radius: float = 0.12
    """A reading is on the path within this distance of it, m: half the width of a small robot. A larger value
    takes walls beside the path for something that goes along."""
    min_beams: int = 2
    """Least number of readings of a scan on the path. A larger value finds less."""
    min_share: float = 0.3
    """Least share of scans with such readings. A smaller value finds who goes along for a part of the way."""
    max_gap: float = 0.2
    """Largest distance between neighbouring readings of one thing, m. A larger value leaves out more."""
    max_size: float = 0.5
    """Largest distance of its readings from the middle of those on the path, m. A larger value leaves out
    more."""
    bin_width: float = math.radians(2.0)
    """Bearings are left out in bins of this width, rad. A larger value leaves out more beside it."""
    min_quarter_share: float = 0.85
    """Least share of what scans see of it that is in the best quarter of all bearings, a mean over the
    scans. It is 0.87 or more for carts and 0.98 for people, and at most 0.69 for dust at 0.1 m, 0.64 for
    odometry that drifts and 0.81 for a laser that looks aside. A larger value finds less."""
    region_scans: int = 600
    """Number of scans, evenly spread in time, that show where it can be, once it is found. More take
    longer."""
    min_sector_share: float = 0.04
    """Bearings are left out if it is seen there in more than this share of these scans. A larger value leaves
    out less."""
    reach_quantile: float = 0.98
    """It is as far away as this quantile of its farthest readings, one of each scan. A larger value leaves
    out more, also of walls beside it."""
    reach_margin: float = 0.15
    """Readings are left out up to this distance beyond that, m. A larger value leaves out more walls."""
    min_covered_share: float = 0.98
    """Least share of a scan's readings up to there for it to cover the laser. A smaller value takes narrow
    rooms for it."""
    min_covered_view: float = math.radians(240.0)
    """Least view of a laser that it can cover, rad: what sees less sees nothing else in front of a wall, too.
    A smaller value takes such places for it."""
    min_covered: int = 2
    """Least number of scans in which it covers the laser for near readings all around to be left out. A
    larger value misses what swings round seldom."""
