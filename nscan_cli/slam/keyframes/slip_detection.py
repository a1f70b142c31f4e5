"""Step 2 of the loop: the scans that tracking may have slipped with, which are better no keyframes.

Along a hedge or a fence a scan fits at several places. One that slips to another leads away from the
odometry, and fewer of its points fit than of those before; some scans later the track slips back. By either
sign alone nothing is told: wheels spin, and what comes into view is new.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from nscan_cli.slam.frontend.tracking_kernels import CLEARLY


class SlipDetector:
    """Looks for slips, scan after scan; `far` is how many standard deviations off the odometry are far."""

    def __init__(self, far: float) -> None:
        self._far, self._usual, self._slipped = far, 0.0, False

    def among(self, found: TrackedScans) -> NDArray[np.bool_]:
        """(n,) which of the next scans may have slipped: those until as much fits again as before."""
        slipped = np.zeros(len(found.off), dtype=np.bool_)
        if not self._slipped and not (found.off > self._far).any():
            self._usual = float(found.inliers[-1])
            return slipped
        for k, (off, inliers) in enumerate(zip(found.off.tolist(), found.inliers.tolist(), strict=True)):
            self._slipped = inliers < self._usual - CLEARLY and (self._slipped or off > self._far)
            if not self._slipped:
                self._usual = inliers
            slipped[k] = self._slipped
        return slipped
