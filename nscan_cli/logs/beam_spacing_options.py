"""The options of `beam_spacing` and `wall_angles`."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class BeamSpacingOptions:
    """When walls contradict the angle between beams."""

    half_width: float = 0.45
    """Angle from a beam to those that it is compared with, rad. A larger value needs wider walls and tells
    angles more precisely."""
    narrow_half_width: float = 0.3
    """A narrower angle that must tell the same, rad: noise looks like wider angles between beams the narrower
    it is. A larger value contradicts more logs."""
    agreement: float = 0.1
    """Largest difference of what the two tell, as a share. A larger value contradicts more logs."""
    settled: float = 0.02
    """The angle is found once it changes by less than this share from one round to the next. A larger value
    is faster and less exact."""
    max_rounds: int = 5
    """Largest number of rounds. A larger value contradicts more logs."""
    same_wall: float = 0.15
    """Largest difference of the angles that two triples about a beam tell, as a share. A larger value takes
    more of what is no wall for one."""
    same_angle: float = 0.06
    """Largest difference of angles that count as one, as a share. A larger value gathers more beams."""
    min_beams: int = 200
    """Least number of beams on walls that tell another angle. A larger value contradicts fewer logs."""
    min_ratio: float = 2.0
    """Least ratio of these beams to those that tell the angle of the log. A larger value contradicts fewer
    logs."""
    min_difference: float = 0.15
    """Least difference from the angle of the log, as a share. A larger value contradicts fewer logs."""
    min_small_difference: float = 0.06
    """Least difference from the angle of the log that most parts of it tell, as a share. A larger value
    contradicts fewer logs."""
    widest_half_width: float = 0.6
    """Angle from a beam to those that it is compared with for small differences, rad. A larger value needs
    wider walls and tells angles more precisely."""
    small_agreement: float = 0.04
    """Largest difference of what `widest_half_width` and `half_width` tell of a small difference, as a share.
    A larger value contradicts more logs."""
    parts: int = 5
    """Number of parts of the log, most of which must tell a small difference. More parts contradict fewer
    logs."""
    min_beams_of_part: int = 40
    """Least number of beams on walls in a part. A larger value contradicts fewer logs."""
    part_agreement: float = 2.0
    """A part tells the same difference if the logarithms of both are within this factor of each other. A
    larger value contradicts more logs."""
    max_factor: float = 2.5
    """Largest factor between the angle of the log and that of the walls. A larger value contradicts more
    logs."""
    max_view: float = math.radians(380)
    """Largest field of view that the angle found may give, rad. A larger value contradicts more logs."""
    max_off_centre: float = 3.0
    """A laser looks ahead if it has fewer beams more than this on one side. With a larger value the angles of
    more logs are put right, and not only named."""
    usual_views: tuple[float, ...] = tuple(map(math.radians, (100, 120, 180, 190, 240, 255, 270, 360)))
    """Fields of view of lasers, rad. With more of them more logs are put right."""
    usual_view: float = 0.06
    """Largest difference of a field of view from a usual one that it is taken for, as a share. A larger value
    puts more logs right."""
    usual_view_near: float = 0.02
    """Largest difference from a usual view, as a share, where the angle of the log is wrong by less than
    `min_difference`. A larger value puts more logs right."""
    usual_view_round: float = 0.03
    """Largest difference from a usual view, as a share, where moreover the angle from beam to beam would be a
    multiple of a quarter of a degree. A larger value puts more logs right."""
    moved: float = 0.01
    """Least median change of the readings between two scans that are tested, as a share: a robot that stands
    sees one scene only. A larger value tests fewer scans."""
    max_scans: int = 200
    """Number of scans that are tested. A larger value takes longer."""
    first_of: int = 4
    """One in this number of these is tested first; the others are not where walls agree with the log. A
    larger value takes less time."""
