"""Step 2 of the loop: scans at which tracking may have slipped, which should not become keyframes.

Along a hedge or a fence a scan fits at several places. One that slips to another is off the odometry, and has
fewer inliers than the scans before; some scans later the track slips back. Neither sign alone is enough:
wheels spin, and new things come into view.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.poses import Mask
from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from nscan_cli.slam.keyframes.options import KeyframeOptions


class SlipDetector:
    """Looks for slips, scan after scan."""

    def __init__(self, options: KeyframeOptions) -> None:
        self._sigmas, self._drop = options.slip_sigmas, options.slip_inlier_drop
        self._usual, self._slipped = 0.0, False

    def find(self, found: TrackedScans) -> Mask:
        """(n,) which of the next scans may have slipped: all until the share of inliers is as before."""
        slipped = np.zeros(len(found.odometry_sigmas), dtype=np.bool_)
        if not self._slipped and not (found.odometry_sigmas > self._sigmas).any():
            self._usual = float(found.inliers[-1])
            return slipped
        for k, (off, inliers) in enumerate(
            zip(found.odometry_sigmas.tolist(), found.inliers.tolist(), strict=True)
        ):
            self._slipped = inliers < self._usual - self._drop and (self._slipped or off > self._sigmas)
            if not self._slipped:
                self._usual = inliers
            slipped[k] = self._slipped
        return slipped
