"""Where something that goes along with the robot can be, as seen from the laser: bearings, and how far.

Readings beyond it are of the world, and are kept.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.calibration.companion_options import CompanionOptions
from nscan_cli.logs.beam_mask import Bearings
from nscan_cli.logs.field_of_view import field_of_view
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.mask_runs import mask_runs
from nscan_cli.poses import Array, Mask


def where_it_is(log: LaserLog, reaches: Array, options: CompanionOptions) -> list[Bearings]:
    """The sectors in which scans of a log see it, and the range up to which.

    reaches: (n, b) how far (m) some see it, by bins of bearings from 0 on counter-clockwise; 0 where they do
    not.
    """
    counts, size = np.count_nonzero(reaches, axis=0), reaches.shape[1]
    # No more than half of all: walls on the path are anywhere.
    usual = counts > max(options.min_sector_share * len(reaches), int(np.sort(counts)[size // 2]))
    found = _sectors(usual, reaches, options)
    return found + _around(log, max((sector[2] for sector in found), default=0.0), options)


def _around(log: LaserLog, reach: float, options: CompanionOptions) -> list[Bearings]:
    """All bearings, up to a range, if some scans see nothing else: it covers the laser.

    A cart on a short bar swings round the laser where the robot turns on the spot.
    """
    first, last, _ = field_of_view(log)
    if abs(last - first) < options.min_covered_view:
        return []
    near = np.count_nonzero(log.ranges < reach, axis=1)
    has = np.count_nonzero(~np.isnan(log.ranges), axis=1)
    covered = (near > 0) & (near >= options.min_covered_share * has)
    if np.count_nonzero(covered) < options.min_covered:
        return []
    inside = log.ranges[covered]
    farthest = float(np.quantile(inside[inside < reach], options.reach_quantile))
    return [(-np.pi, np.pi, round(min(farthest + options.reach_margin, reach), 2))]


def _sectors(chosen: Mask, reaches: Array, options: CompanionOptions) -> list[Bearings]:
    """The sectors of chosen bins (b,) and one beside them, with ranges."""
    found, size = list[Bearings](), len(chosen)
    wide = chosen | np.roll(chosen, 1) | np.roll(chosen, -1)
    if not wide.any():
        return []
    # Counted from a bin that is not chosen, no sector goes on beyond the last one.
    start = 0 if wide.all() else int(np.argmin(wide))
    for begin, end in mask_runs(np.roll(wide, -start)):
        farthest = np.roll(reaches, -start, axis=1)[:, begin:end].max(axis=1)
        reach = float(np.quantile(farthest[farthest > 0.0], options.reach_quantile)) + options.reach_margin
        sides = (start + np.array([begin, end])) % size * options.bin_width
        first, last = (np.mod(sides + np.pi, 2 * np.pi) - np.pi).tolist()
        if end - begin == size:
            first, last = -np.pi, np.pi
        found.append((first, last, round(reach, 2)))
    return found
