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
    wide: float = math.radians(20.0)
    """Where few scans tell by themselves, all of them must tell about the same gap by walls of the usual
    width and by walls of this one, rad: noise makes a gap of narrow walls larger. A larger value needs wider
    walls."""
    beside: float = math.radians(1.0)
    """Gaps that differ from that of a revolution by this and by twice as much are compared for it, rad. A
    larger value takes more corners for walls."""
    max_apart: float = 0.5
    """Such a gap is off that of a revolution by this share of what the beams cover too much or too little, at
    most. A larger value puts more logs right."""
    sigmas: float = 5.0
    """It is off the gap of the log by so many standard deviations, at least. A larger value puts fewer logs
    right."""
    blocks: int = 12
    """Number of stretches of successive scans whose scatter is that standard deviation. With more, scans that
    see the same count as different ones."""


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
    told = _telling_scans(ranges, step, off, checks) or _agreeing_scans(ranges, off, checks)
    if not told:
        return directions, []
    whole = math.copysign(2 * math.pi / count, step)
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


def _telling_scans(ranges: Array, step: float, off: float, checks: WholeRevolutionOptions) -> int:
    """The number of scans (N, B) that tell a revolution each by itself; 0 if it is not beyond doubt.

    The beams are `step` apart by the log, and cover more than a revolution by `off`, rad.
    """
    whole = 2 * math.pi / ranges.shape[1]
    beside = np.arange(-2, 3) * checks.tried
    gaps = [abs(step) - off, *(whole + beside).tolist()]
    misfits = np.minimum(_misfits(ranges, whole, checks.width, gaps, checks), checks.most**2)
    by_log, by_whole = misfits[:, 0], misfits[:, 3]
    told = int(np.count_nonzero(by_log > checks.min_gain * by_whole))
    against = int(np.count_nonzero(by_whole > checks.min_gain * by_log))
    is_told = told >= max(checks.min_scans, checks.min_share * (told + against))
    return told if is_told and misfits.mean(axis=0).argmin() == 3 else 0


def _agreeing_scans(ranges: Array, off: float, checks: WholeRevolutionOptions) -> int:
    """The number of scans (N, B) that tell a revolution together; 0 if it is not beyond doubt.

    The beams cover more than a revolution by `off`, rad, by the log.
    """
    whole, told = 2 * math.pi / ranges.shape[1], 0
    gaps = whole + np.arange(-2, 3) * checks.beside
    for width in (checks.width, checks.wide):
        misfits = _misfits(ranges, whole, width, gaps.tolist(), checks)
        count, gap, sigma = _mean_gap(misfits, gaps, checks)
        # What the log leaves of a revolution.
        by_log = whole - off / ranges.shape[1] * (ranges.shape[1] - 1)
        is_whole = abs(gap - whole) <= checks.max_apart * abs(off)
        if count < checks.min_scans or not is_whole or abs(gap - by_log) < checks.sigmas * sigma:
            return 0
        told = told or count
    return told


def _mean_gap(misfits: Array, gaps: Array, checks: WholeRevolutionOptions) -> tuple[int, float, float]:
    """How many scans tell a gap from the last beam to the first, that gap, and its standard deviation, rad.

    `misfits` (W, G) are theirs with each of `gaps` (G,). Those with less noise and a wider wall tell more.
    """
    constant, slope, curve = np.polynomial.polynomial.polyfit(gaps - gaps.mean(), misfits.T, 2)
    bends = curve > 0.0
    constant, slope, curve = constant[bends], slope[bends], curve[bends]
    found, least = -0.5 * slope / curve, constant - 0.25 * slope**2 / curve
    reach = float(np.ptp(gaps))
    is_near = (np.abs(found) < reach) & (least > 0.0)
    if np.count_nonzero(is_near) < checks.min_scans:
        return 0, 0.0, math.inf
    found, weights = found[is_near], curve[is_near] / least[is_near]
    # No scan outweighs the others.
    weights = np.minimum(weights, np.quantile(weights, 0.9))
    order = np.argsort(found)
    usual = found[order][np.searchsorted(np.cumsum(weights[order]), 0.5 * weights.sum())]
    weights = weights / np.maximum(
        1.0, np.abs(found - usual) / (1.5 * np.median(np.abs(found - usual)) + 1e-9)
    )
    mean = float((weights * found).sum() / weights.sum())
    sums = [float(part.sum()) for part in np.array_split(weights * (found - mean), checks.blocks)]
    return len(found), float(gaps.mean()) + mean, float(np.linalg.norm(sums) / weights.sum())


def _misfits(
    ranges: Array, step: float, width: float, gaps: list[float], checks: WholeRevolutionOptions
) -> Array:
    """(W, G) mean squares by which one wall misses the last and the first beams of W scans, as a share.

    `ranges` (N, B) are readings, m, `step` the angle from beam to beam, `width` how far the beams are taken
    on each side, and `gaps` G angles from the last beam to the first, rad.
    1 / r = a cos φ + b sin φ on a wall, and a and b are least squares.
    """
    count = max(checks.least_beams, round(width / step))
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
    kept: Array = found[found.min(axis=1) <= checks.on_wall**2]
    return kept
