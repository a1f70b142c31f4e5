"""The parameters of steps from scan to scan, by which a file is compared with its scans."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from nscan_cli.matching.pairwise import PairOptions
from nscan_cli.matching.search_options import SearchOptions


@dataclass(frozen=True)
class StepOptions:
    """Which steps from scan to scan are measured, and which measurements count."""

    count: int = 30
    """Steps spread evenly over the log; as many again are measured where odometry turns most. More tell more
    and take longer."""
    most: int = 1_500
    """Largest number of steps of a calibration, about. More tell more and take longer."""
    chain: int = 12
    """Number of successive steps whose turns are summed and compared with odometry. Over longer chains errors
    of stamps matter less, and one failed match spoils more."""
    duration: float = 0.4
    """Least duration of a step, s. In a longer step the robot moves more; if it is too long, the scans no
    longer overlap."""
    max_duration: float = 2.0
    """Longest step that is measured, s: in a longer one scans are missing. A larger value measures across
    longer gaps."""
    compared_beams: int = 32
    """Approximate number of beams by which scans that repeat the one before are told. More take longer."""
    max_turn: float = 0.4
    """Steps that turn by more than this (rad) are not preferred to each other: they may not match. A larger
    value prefers larger turns."""
    turning_excess: int = 5
    """The steps with a turn are chosen evenly from this multiple of their number, those where odometry turns
    most. With a larger value they come from more places, and turn less."""
    min_overlap: float = 0.6
    """Least share of a scan's points that lie on the other scan. A larger share accepts fewer steps."""
    search: SearchOptions = field(default_factory=lambda: SearchOptions(distance=2.5, turn=0.8))
    """The search for a step whose scans do not overlap so much. A wider one finds faster robots and takes
    longer."""
    min_searched_overlap: float = 0.5
    """Least share of a scan's points that lie on the other scan where the search has found the step: outdoors
    half of what a scan sees may be new. A larger share accepts fewer steps."""
    max_beams: int = 180
    """Approximate number of beams of a scan that are matched, evenly spread. More tell more and take
    longer."""
    probe: float = 0.2
    """Each step is matched a second time from a start this far off (m), in its least certain direction: along
    a corridor a match ends where it starts. A larger value accepts fewer steps."""
    agreement: float = 0.03
    """Largest difference of the two matches of a step, m and rad. A larger value accepts less certain
    steps."""
    max_sigma: float = 0.05
    """Largest standard deviation of the place of a step, in its least certain direction, m: else it tells its
    turn alone. It is less in 97 of 100 steps of real logs. A larger value accepts less certain steps."""
    max_turn_sigma: float = 0.02
    """Largest standard deviation of the turn of a step, rad. A larger value accepts less certain steps."""
    narrow_view: float = math.radians(150.0)
    """Of a laser that sees less than this, rad, only the points that both scans of a step have in view are
    matched. With a larger value fewer steps of wider lasers count, and take longer."""
    view_margin: float = 0.3
    """Points this near (m) to the border of such a view do not count: more than `probe`. A larger margin
    matches fewer points."""
    min_motion: float = 0.05
    """A step has motion if the scans say at least this length (m), and a turn if they say at least this angle
    (rad). With a larger value fewer steps count, and each tells more."""
    metres_per_radian: float = 0.3
    """Motion that a turn of one radian counts as, m. With a larger value turns weigh more."""
    pair: PairOptions = field(default_factory=lambda: PairOptions(tolerance=1e-4, coarse_tolerance=3e-3))
    """How the two scans of a step are matched: more exactly than by default."""
