"""A floor plan as a laser sees it: line segments and circles, each with a share of beams that it swallows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.poses import Array


@dataclass(frozen=True)
class World:
    """The obstacles of a scene."""

    segments: Array
    """(N, 4): x1, y1, x2, y2 in m."""
    absorption: Array
    """(N,) probability that a beam on a segment does not come back; glass has a high one."""
    circles: Array
    """(M, 3): x, y, radius in m."""

    def clearance(self, points: Array) -> Array:
        """Distance (P,) of points (P, 2) to the nearest obstacle."""
        start, edge = self.segments[:, :2], self.segments[:, 2:] - self.segments[:, :2]
        offset = points[:, None] - start
        along = np.clip(np.sum(offset * edge, axis=-1) / np.sum(edge**2, axis=-1), 0, 1)
        nearest: Array = np.linalg.norm(offset - along[..., None] * edge, axis=-1).min(axis=1)
        if len(self.circles):
            centres = np.linalg.norm(points[:, None] - self.circles[:, :2], axis=-1) - self.circles[:, 2]
            nearest = np.minimum(nearest, centres.min(axis=1))
        return nearest


class Builder:
    """Collects walls and furniture into a World."""

    def __init__(self) -> None:
        self._segments: list[tuple[float, float, float, float]] = []
        self._absorption: list[float] = []
        self._circles: list[tuple[float, float, float]] = []

    def line(self, x1: float, y1: float, x2: float, y2: float, absorption: float = 0.0) -> None:
        """One face of a wall."""
        self._segments.append((x1, y1, x2, y2))
        self._absorption.append(absorption)

    def box(
        self, x1: float, y1: float, x2: float, y2: float, turn: float = 0.0, absorption: float = 0.0
    ) -> None:
        """A box by two opposite corners, turned about its centre by `turn` (rad)."""
        centre = np.array([(x1 + x2) / 2, (y1 + y2) / 2])
        corners = np.array([(x1, y1), (x2, y1), (x2, y2), (x1, y2)]) - centre
        c, s = np.cos(turn), np.sin(turn)
        corners = corners @ np.array([[c, s], [-s, c]]) + centre
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            self.line(a[0], a[1], b[0], b[1], absorption)

    def pillar(self, x: float, y: float, radius: float) -> None:
        """A round pillar or the leg of a chair."""
        self._circles.append((x, y, radius))

    def wall(
        self,
        start: tuple[float, float],
        end: tuple[float, float],
        openings: tuple[tuple[float, float], ...] = (),
        thickness: float = 0.15,
        absorption: float = 0.0,
    ) -> None:
        """A wall along x or y between two points, with openings (centre along the wall's axis, width).

        Openings have frames as deep as the wall is thick.
        """
        axis = 0 if start[1] == end[1] else 1
        half = thickness / 2
        begin = start[axis] - half
        for centre, width in (*sorted(openings), (end[axis] + half, 0.0)):
            stop = centre - width / 2
            low, high = [begin, start[1] - half], [stop, start[1] + half]
            if axis == 1:
                low, high = [start[0] - half, begin], [start[0] + half, stop]
            self.box(low[0], low[1], high[0], high[1], absorption=absorption)
            begin = centre + width / 2

    def world(self) -> World:
        """What was collected."""
        return World(
            np.array(self._segments, dtype=np.float64).reshape(-1, 4),
            np.array(self._absorption, dtype=np.float64),
            np.array(self._circles, dtype=np.float64).reshape(-1, 3),
        )
