"""Step 1 where a track segment begins: the first scan is matched with those after it.

The second scan has nothing but the first to be matched with, the third has two. So the error of that match
stays with the first scan, while all later ones agree with each other, and the whole map is turned by it.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.matching.motion_model import Prior
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.options import TrackingOptions, TrackingParameters
from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.scan_to_map import match_and_count
from nscan_cli.slam.frontend.tracked_scans import TrackedScans


def place_first(scans: ScanBatch, found: TrackedScans, options: TrackingOptions) -> Array:
    """The pose (3,) of the first of some scans, matched with the others; the step to the next is the prior.

    It stays where it was found if too few of its points are inliers.
    """
    first: Array = found.poses[0]
    joined = np.flatnonzero(found.in_map[1:]) + 1
    if not len(joined):
        return first
    points, ends = scans.chosen(joined)
    ndt = Ndt.of_scans(points, ends, found.poses[joined], options.gaussians)
    pose, hessian = first.copy(), np.empty((3, 3))
    step: Array = np.linalg.inv(found.prior_covariances[1]).astype(np.float64)
    prior = Prior(first, step)
    _, inliers = match_and_count(ndt.grid, TrackingParameters.of(options), scans.of(0), prior, pose, hessian)
    return pose if inliers >= options.scan.restart_inliers else first
