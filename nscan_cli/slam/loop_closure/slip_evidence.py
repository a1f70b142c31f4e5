"""Where tracking may have slipped, as odometry tells (paper, V: large loops)."""

from __future__ import annotations

from collections import deque

import numpy as np

from nscan_cli.poses import Array, relative, wrap
from nscan_cli.slam.loop_closure.options import LoopClosureOptions


class SlipEvidence:
    """Compares tracking with odometry from keyframe to keyframe.

    Where both agreed so far and now differ by far more, one of them has slipped, and nothing tells which. So
    the path may be off by any part of the difference. Wheels slip in turns: these are compared with turns.
    """

    def __init__(self, options: LoopClosureOptions) -> None:
        self._options = options
        self._straight: deque[tuple[float, float]] = deque(maxlen=options.usual_steps)
        """Square differences a metre of path: of a coordinate, m²/m, and of the angle, rad²/m."""
        self._turns: deque[tuple[float, float]] = deque(maxlen=options.usual_steps)
        """Square differences a metre of path, of steps that turn."""

    def variances(self, step: Array, odometry: Array, length: float) -> tuple[float, float]:
        """The variances of a coordinate (m²) and of the angle (rad²) by which a step (3,) may have slipped.

        `odometry` is the step (3,) by odometry, nan where there is none; `length` is that of its path (m).
        The variances are 0 where both agree. If all places between both are as likely, the variance about one
        end is a third of the square.
        """
        options = self._options
        if not (np.isfinite(odometry).all() and length > 0.0):
            return 0.0, 0.0
        off = relative(step, odometry)
        squares = np.array([0.5 * (off[0] ** 2 + off[1] ** 2), wrap(off[2]) ** 2])
        turns = max(abs(step[2]), abs(odometry[2])) > options.turning
        like = self._turns if turns else self._straight
        like.append(tuple((squares / length).tolist()))
        if len(like) < options.min_compared_steps:
            return 0.0, 0.0
        usual = np.median(np.array(like), axis=0) * length
        place, angle = np.where(squares > options.disagreement**2 * usual, squares / 3, 0.0).tolist()
        return place, angle
