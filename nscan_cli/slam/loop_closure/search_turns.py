"""Turns of the pieces of a map among which a keyframe is searched that may be anywhere.

Where the track broke often the map is in many pieces. If each keyframe were searched among all of them, time
would grow with the square of the path.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nscan_cli.poses import Array, Indices
from nscan_cli.slam.loop_closure.options import LoopClosureOptions


class SearchTurns:
    """Which pieces are next. Pieces change with the map, so turns are those of their keyframes."""

    def __init__(self, options: LoopClosureOptions) -> None:
        self._options = options
        self._searched = np.empty(0)
        """(K,) the path at which a search among each keyframe was the last one, m."""

    def next(self, pieces: Sequence[Indices]) -> list[int]:
        """The indices of the pieces (m_i,) whose turn it is, in order; all of them if they are few.

        They are those with a keyframe among which the search is the longest ago.
        """
        longest_ago = [self._known(piece)[piece].min() for piece in pieces]
        turns = np.argsort(longest_ago, kind="stable")[: self._options.max_lost_searches]
        return sorted(turns.tolist())

    def took(self, piece: Indices, path: float, found: bool) -> None:
        """Say that a keyframe was searched at a length of `path` (m) among a piece (m,).

        Where something was found it is soon the turn again: only keyframes within `agreement_path` agree.
        """
        self._known(piece)[piece] = path - self._options.agreement_path * found

    def _known(self, piece: Indices) -> Array:
        more = max(int(piece.max(initial=-1)) + 1 - len(self._searched), 0)
        self._searched = np.pad(self._searched, (0, more), constant_values=-np.inf)
        return self._searched
