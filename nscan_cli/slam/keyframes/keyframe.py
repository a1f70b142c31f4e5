"""Step 2 of the loop (paper, V): keyframes, the scans that are nodes of the graph, with their Gaussians.

The NDT of a keyframe is made of the scans between its neighbours, as tracking placed them: a few centimetres
of motion fill the gaps between the beams. Its points are those of its own scan.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from nscan_cli.ndt.hash_grid import WALL_END
from nscan_cli.ndt.options import GaussianOptions
from nscan_cli.ndt.transform import Ndt
from nscan_cli.poses import Array, Indices, relative
from nscan_cli.slam.frontend.tracked_scans import TrackedScan

LATTICE_WIDTH = 2.0**26
"""More cells than a row of a lattice has."""
INITIAL_CELLS_PER_POINT = 16
"""Lattice cells per point of a scan for which an NDT has room at first. Most need no more."""


class KeyframePoints(NamedTuple):
    """Scans, with arrays of their own, and their tracked poses."""

    points: Array
    """(P, 2) one after another, each in its robot's frame."""
    sizes: Indices
    """(n,) number of points of each scan."""
    poses: Array
    """(n, 3)"""


@dataclass
class Keyframe:
    """A scan of the graph."""

    row: int
    """Row in the log; the id of its node."""
    tracked: TrackedScan
    prior_covariance: Array
    """(3, 3) covariance of the way from the keyframe before, without any match."""
    points: Array
    """(m, 2) in the robot's frame."""
    cells: int
    """Number of lattice cells of the NDT that its points fall into."""
    gaussians: GaussianOptions
    around: list[KeyframePoints]
    """What the NDT is made of: its own scan, and those up to the keyframes beside it."""
    guess_variances: Array = field(default_factory=lambda: np.zeros(2))
    """(2,) variances of the place (m²) and the turn (rad²) of the way from the keyframe before, as far as it
    is a guess that no scan tells."""
    _ndt: Ndt | None = None

    @property
    def ndt(self) -> Ndt:
        """The Gaussians of its scans, made at the first call."""
        return self.make_ndt()

    def make_ndt(self) -> Ndt:
        """Make the Gaussians, unless they are there, and drop the scans; none can join any more."""
        around = self.around
        if self._ndt is None:
            points, sizes, poses = (np.concatenate(columns) for columns in zip(*around, strict=True))
            ends = np.append(0, np.cumsum(sizes))
            poses, room = relative(poses, self.tracked.pose), INITIAL_CELLS_PER_POINT * len(self.points)
            ndt = Ndt.of_scans(points, ends, poses, self.gaussians, room, WALL_END)
            # In this order: another thread that makes it at the same time has what it needs.
            self._ndt, self.around = ndt, []
        return self._ndt


def points_per_cell(keyframes: Iterable[Keyframe]) -> float:
    """Mean number of points of a scan in a lattice cell that has any; at least 1."""
    points = cells = 0
    for keyframe in keyframes:
        points, cells = points + len(keyframe.points), cells + keyframe.cells
    return points / cells if cells else 1.0


def count_cells(points: Array, side: float) -> int:
    """Number of cells of one lattice that the points (m, 2) fall into."""
    cells = np.floor(points / side)
    # No laser sees so far that two cells would have the same number.
    return len(np.unique(cells[:, 0] * LATTICE_WIDTH + cells[:, 1]))
