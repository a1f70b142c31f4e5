"""Step 6 of the loop: the matches of step 3 again, from the poses that all relations together have found.

A match made on the way knew only what had been seen so far, and started from poses that later loops have
corrected. From the final poses, and with the scans of all visits, some find a better place; the graph moves,
and those about what has moved are matched again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nscan_cli.graph.model import Loop, NScan, Pairwise
from nscan_cli.poses import Array, relative, wrap
from nscan_cli.slam.coverage import Coverage
from nscan_cli.slam.keyframes import Keyframe, paths_of
from nscan_cli.slam.nearby import MatchNearby, Nearby, choose_nearby
from nscan_cli.slam.options import NScanOptions


class Refinement:
    """The relations about all keyframes, each as of the poses that it was last matched from."""

    def __init__(
        self,
        keyframes: Sequence[Keyframe],
        chain: Sequence[Pairwise],
        options: NScanOptions,
        match: MatchNearby,
        wider: Mapping[int, float],
    ) -> None:
        """Take the radius (m) about some centres that is `wider`: where large loops were closed."""
        self._keyframes, self._chain, self._options, self._match = keyframes, chain, options, match
        self._wider, self._covered = wider, Coverage()
        self._paths = paths_of(keyframes)
        self._found: list[Nearby | None] = [None] * len(keyframes)
        self._starts: list[tuple[NDArray[np.int64], Array] | None] = [None] * len(keyframes)

    def sweep(self, poses: Array, moved: float) -> int:
        """Match again about the keyframes whose neighbours have moved by more than `moved` (m, rad).

        `poses` (K, 3) are the global ones; returns how many were matched.
        """
        matched = 0
        for centre in range(len(self._keyframes)):
            if not self._has_moved(centre, poses, moved):
                continue
            options = self._options
            if centre in self._wider:
                options = replace(options, radius=self._wider[centre])
            tried, _ = choose_nearby(poses, self._paths, centre, options)
            node, others = self._keyframes[centre].row, [self._keyframes[k].row for k in tried.tolist()]
            needed = self._starts[centre] is not None or centre in self._wider
            if not needed and self._covered.share(node, others) >= options.covered:
                continue
            nearby = self._match(self._keyframes, poses, self._chain, centre, options)
            self._covered.add(node, others, nearby)
            self._starts[centre], self._found[centre] = (tried, relative(poses[tried], poses[centre])), nearby
            matched += 1
        return matched

    def relations(self) -> tuple[list[Pairwise], list[NScan]]:
        """The relations as they are now: of single matches, and of joint ones."""
        found = [nearby for nearby in self._found if nearby is not None]
        pairs = [relation for nearby in found for relation in nearby.pairwise]
        return pairs, [nearby.nscan for nearby in found if nearby.nscan is not None]

    def loops(self) -> list[Loop]:
        """The verdicts on other visits that these relations come from."""
        return [nearby.loop for nearby in self._found if nearby is not None and nearby.loop is not None]

    def _has_moved(self, centre: int, poses: Array, moved: float) -> bool:
        start = self._starts[centre]
        if start is None:
            return True
        tried, before = start
        shift = relative(poses[tried], poses[centre]) - before
        shift[:, 2] = wrap(shift[:, 2])
        return bool(np.abs(shift).max() > moved)
