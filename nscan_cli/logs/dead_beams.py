"""Beams that always say exactly the same while the others change: a dead pixel, or a part of the robot.

A wall never does: readings have noise, and a robot that drives changes its distance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.logs.mask_runs import mask_runs
from nscan_cli.logs.robot_parts import ScanTable, Sector
from nscan_cli.poses import Mask


@dataclass(frozen=True)
class DeadBeamOptions:
    """When a beam always says the same."""

    scans: int = 256
    """Number of scans that are compared, evenly spread. More take longer."""
    min_scans: int = 32
    """Least number of scans of a log that is looked at. A larger number finds fewer."""
    min_share: float = 0.95
    """Least share of these scans in which the beam says exactly the same. A smaller value leaves out more."""
    max_usual_share: float = 0.5
    """Greatest share of scans in which the usual beam does so: else the robot stands. A larger value finds
    more, also where the robot stands for most of the log."""
    max_dead_share: float = 0.5
    """Greatest share of the beams that are left out. A larger value leaves less to make a map from."""


def dead_beams(table: ScanTable, options: DeadBeamOptions = DeadBeamOptions()) -> list[Sector]:
    """The sectors whose beams say exactly one usable range in nearly all scans; none if the robot stands."""
    if len(table.rows) < options.min_scans:
        return []
    places = np.unique(np.linspace(0, len(table.rows) - 1, options.scans).astype(np.int64))
    ranges = table.ranges[table.rows[places]]
    # One of two scans may be one of the few in which a beam says something else.
    two = [len(places) // 3, 2 * len(places) // 3]
    values, limits = ranges[two], table.limits.of(table.rows[places[two]])
    is_usable = (values > limits.low[:, None]) & (values < limits.high[:, None])
    same = np.stack([(ranges == value).mean(axis=0) for value in values])
    told = is_usable.any(axis=0)
    if not told.any() or np.median(same.max(axis=0)[told]) > options.max_usual_share:
        return []
    is_dead: Mask = np.any(is_usable & (same >= options.min_share), axis=0)
    if np.count_nonzero(is_dead) > options.max_dead_share * len(is_dead):
        return []
    first, step = float(table.angle_min[table.rows[0]]), float(table.angle_increment[table.rows[0]])
    found = []
    for begin, end in mask_runs(is_dead):
        left, right = first + step * (begin - 0.5), first + step * (end - 0.5)
        found.append(Sector(min(left, right), max(left, right), float(np.median(values[:, begin:end]))))
    return sorted(found)
