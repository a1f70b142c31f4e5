"""Step 1 of the loop, where a track begins: the first scan, matched with those after it.

The second scan has nothing but the first to be matched with, the third two; so what the second one is off by
stays the first one's error, while all later ones agree with each other. Seen from the first keyframe, the
whole map is then turned by it.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.matching.priors import Prior
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.options import TrackingOptions
from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.scan_to_map import match_and_count
from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from nscan_cli.slam.frontend.tracking_parameters import TrackingParameters

PATH = 5.0
"""Those after it are the scans of so much path, m,"""
SCANS = 2_000
"""and no more than these: a robot may stand for hours."""


def place_first(scans: ScanBatch, found: TrackedScans, options: TrackingOptions) -> Array:
    """The pose (3,) of the first of some scans where the others have it.

    The odometry between it and the next one holds what these leave open. It stays where it was found when
    they do not see what it sees.
    """
    first: Array = found.poses[0]
    joined = np.flatnonzero(found.joined[1:]) + 1
    if not len(joined):
        return first
    gaussians = options.gaussians
    points, ends = scans.chosen(joined)
    ndt = Ndt.of_scans(points, ends, found.poses[joined], gaussians.cell, gaussians.minimum, gaussians.floor)
    pose, hessian = first.copy(), np.empty((3, 3))
    step: Array = np.linalg.inv(found.expected[1]).astype(np.float64)
    prior = Prior(first, step)
    _, inliers = match_and_count(ndt.grid, TrackingParameters.of(options), scans.of(0), prior, pose, hessian)
    return pose if inliers >= options.restart_inliers else first
