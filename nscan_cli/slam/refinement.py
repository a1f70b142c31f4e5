"""Step 5 of the loop: joint matches again, from the poses that all relations together have found.

A match made on the way knew only what had been seen so far, and started from poses that later loops have
corrected. From the final poses, and with the scans of all visits, some find a better place; the graph moves,
and those about what has moved are matched again.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from nscan_cli.graph.model import NScan, Pairwise
from nscan_cli.poses import Array, relative, wrap
from nscan_cli.slam.keyframes import Keyframe
from nscan_cli.slam.nearby import choose_nearby, match_nearby
from nscan_cli.slam.options import NScanOptions


class Refinement:
    """The nScan relations about all keyframes, each as of the poses that it was last matched from."""

    def __init__(
        self, keyframes: Sequence[Keyframe], pairwise: Sequence[Pairwise], options: NScanOptions
    ) -> None:
        self._keyframes, self._pairwise, self._options = keyframes, pairwise, options
        self._paths = np.array([keyframe.tracked.path for keyframe in keyframes])
        self._relations: list[NScan | None] = [None] * len(keyframes)
        self._starts: list[tuple[NDArray[np.int64], Array] | None] = [None] * len(keyframes)

    def sweep(self, poses: Array, moved: float) -> int:
        """Match again about the keyframes whose neighbours have moved by more than `moved` (m, rad).

        `poses` (K, 3) are the global ones; returns how many were matched.
        """
        matched = 0
        for centre in range(len(self._keyframes)):
            if not self._has_moved(centre, poses, moved):
                continue
            tried, _ = choose_nearby(poses, self._paths, centre, self._options)
            self._starts[centre] = tried, relative(poses[tried], poses[centre])
            nearby = match_nearby(self._keyframes, poses, self._pairwise, centre, self._options)
            self._relations[centre] = None if nearby is None else nearby.relation
            matched += 1
        return matched

    def relations(self) -> list[NScan]:
        """The relations as they are now."""
        return [relation for relation in self._relations if relation is not None]

    def _has_moved(self, centre: int, poses: Array, moved: float) -> bool:
        start = self._starts[centre]
        if start is None:
            return True
        tried, before = start
        shift = relative(poses[tried], poses[centre]) - before
        shift[:, 2] = wrap(shift[:, 2])
        return bool(np.abs(shift).max() > moved)
