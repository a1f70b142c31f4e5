"""The angle between beams of a laser that sees all around: walls go on from its last beam to its first.

Some drivers divide the revolution by one beam too few, or are off by a percent. The beams then seem to
overlap at the end, or to leave a gap, and walls have a step there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nscan_cli.files.text import counted
from nscan_cli.logs.beam_angles import BeamDirections
from nscan_cli.logs.laser_log import beam_counts
from nscan_cli.logs.range_limits import RangeLimits
from nscan_cli.logs.raw_scans import RawScans
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.wall_angles import BeamSpacingOptions, sampled_scans
from nscan_cli.poses import Array


@dataclass(frozen=True)
class WholeRevolutionOptions:
    """When beams cover a revolution though the file has another angle between them."""

    max_off: float = 0.15
    """Largest difference of what the beams cover by the file from a revolution, as a share. A larger value
    checks more lasers."""
    min_off: float = math.radians(0.4)
    """Least difference of what the beams cover by the file from a revolution, rad. A smaller value checks
    more lasers."""
    width: float = math.radians(12.0)
    """Beams so far before the last and behind the first are taken for one wall, rad. A larger value needs
    wider walls, and tells more."""
    least_beams: int = 4
    """Least number of beams on each side. A larger value needs wider walls."""
    tried: float = math.radians(2.0)
    """Gaps that differ from that of a revolution by this and by twice as much must fit worse, rad. A larger
    value checks less."""
    on_wall: float = 0.012
    """Readings are of one wall if it explains them to within this share (RMS). A larger value takes more for
    walls."""
    most: float = 0.03
    """Misfits count up to this share of the range, so that no scan outweighs the others. A larger value gives
    scans that fit badly more weight."""
    max_scans: int = 1000
    """Number of scans that are tested. A larger value takes longer."""
    min_gain: float = 2.0
    """A scan tells which is right if the squared misfits differ by this factor. With a larger value fewer
    scans tell."""
    min_scans: int = 10
    """Least number of scans that tell a revolution. A larger value puts fewer logs right."""
    min_share: float = 0.9
    """Least share of these scans among all that tell. A larger value puts fewer logs right."""


def in_whole_revolutions(
    raw: RawScans, directions: BeamDirections, limits: RangeLimits, options: ReadingOptions
) -> tuple[BeamDirections, list[str]]:
    """The directions of beams over one revolution if walls show that they cover one; and the messages."""
    checks = WholeRevolutionOptions()
    beams = beam_counts(raw.ranges, raw.beams)
    count, step = int(beams[0]), float(np.median(directions.step))
    off = count * abs(step) - 2 * math.pi
    is_near = checks.min_off <= abs(off) <= checks.max_off * 2 * math.pi
    is_set = options.as_recorded or options.angle_increment is not None
    if is_set or not is_near or (beams != count).any() or (directions.step != directions.step[0]).any():
        return directions, []
    rows = np.arange(0, len(beams), max(1, len(beams) // checks.max_scans))
    ranges = sampled_scans(raw, directions, limits, rows).ranges[:, :count]
    whole = math.copysign(2 * math.pi / count, step)
    beside = np.arange(-2, 3) * checks.tried
    gaps = [abs(step) - off, *(abs(whole) + beside).tolist()]
    misfits = _misfits(ranges, abs(whole), gaps, checks)
    by_log, by_whole = misfits[:, 0], misfits[:, 3]
    told = int(np.count_nonzero(by_log > checks.min_gain * by_whole))
    against = int(np.count_nonzero(by_whole > checks.min_gain * by_log))
    is_told = told >= max(checks.min_scans, checks.min_share * (told + against))
    if not is_told or misfits.mean(axis=0).argmin() != 3:
        return directions, []
    # A laser that looks ahead keeps its middle; others, their first direction.
    first, half = directions.first, 0.5 * (count - 1)
    if abs(2 * float(first[0]) + step * (count - 1)) < BeamSpacingOptions.max_off_centre * abs(step):
        first = first + half * (step - whole)
    said = (
        f"{counted(count, 'beam')} with the {math.degrees(abs(step)):.5g}° of the log cover "
        f"{math.degrees(count * abs(step)):.1f}°, but walls go on from the last to the first as if it were "
        f"one turn, in {counted(told, 'scan')}: {math.degrees(abs(whole)):.5g}° are used; --as-recorded "
        "leaves the beams as they are"
    )
    return BeamDirections(first, np.full(len(beams), whole)), [said]


def _misfits(ranges: Array, step: float, gaps: list[float], checks: WholeRevolutionOptions) -> Array:
    """(W, G) mean squares by which one wall misses the last and the first beams of W scans, as a share.

    `ranges` (N, B) are readings, m, `step` the angle from beam to beam, and `gaps` G angles from the last
    beam to the first, rad. 1 / r = a cos φ + b sin φ on a wall, and a and b are least squares.
    """
    count = max(checks.least_beams, round(checks.width / step))
    if 2 * count > ranges.shape[1]:
        return np.empty((0, len(gaps)))
    both = np.concatenate([ranges[:, -count:], ranges[:, :count]], axis=1)
    both = both[np.isfinite(both).all(axis=1)]
    found = np.empty((len(both), len(gaps)))
    for column, gap in enumerate(gaps):
        angles = np.concatenate([step * np.arange(1 - count, 1), gap + step * np.arange(count)])
        # Times the range, so that all beams have the same noise.
        x, y = both * np.cos(angles), both * np.sin(angles)
        xx, xy, yy, x1, y1 = ((one * other).sum(axis=1) for one, other in
                              ((x, x), (x, y), (y, y), (x, np.ones(1)), (y, np.ones(1))))  # fmt: skip
        determinant = xx * yy - xy * xy
        a, b = (yy * x1 - xy * y1) / determinant, (xx * y1 - xy * x1) / determinant
        found[:, column] = ((a[:, None] * x + b[:, None] * y - 1.0) ** 2).mean(axis=1)
    kept: Array = np.minimum(found[found.min(axis=1) <= checks.on_wall**2], checks.most**2)
    return kept
