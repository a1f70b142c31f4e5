"""Step 1 of the loop, where a track begins: the first scan, matched with those after it.

The second scan has nothing but the first to be matched with, the third two; so what the second one is off by
stays the first one's error, while all later ones agree with each other. Seen from the first keyframe, the
whole map is then turned by it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from nscan_cli.matching.priors import Prior
from nscan_cli.ndt.grid import Ndt
from nscan_cli.poses import Array
from nscan_cli.slam.options import TrackingOptions
from nscan_cli.slam.settings import Settings
from nscan_cli.slam.track import match_and_count

if TYPE_CHECKING:
    from nscan_cli.slam.tracking import Tracked

PATH = 5.0
"""Those after it are the scans of so much path, m."""


def place_first(
    first: Tracked, points: Array, scans: Sequence[Array], after: Sequence[Tracked], options: TrackingOptions
) -> Tracked:
    """The first scan, points (m, 2), where the scans (m, 2) after it have it.

    The odometry between it and the next one holds what these leave open. It stays where it was when they
    do not see what it sees.
    """
    joined = [k for k, tracked in enumerate(after) if tracked.joined]
    if not joined:
        return first
    gaussians = options.gaussians
    ndt = Ndt(gaussians.cell, gaussians.minimum, gaussians.floor)
    ndt.gather([scans[k] for k in joined], np.array([after[k].pose for k in joined]))
    ndt.make()
    pose, hessian = first.pose.copy(), np.empty((3, 3))
    step: Array = np.linalg.inv(after[0].expected).astype(np.float64)
    prior = Prior(first.pose, step)
    _, inliers = match_and_count(ndt.grid, Settings.of(options), points, prior, pose, hessian)
    return replace(first, pose=pose) if inliers >= options.inlier_share else first
