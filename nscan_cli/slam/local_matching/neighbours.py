"""The choice of the keyframes that are matched with a keyframe (paper, V: step 3 of the loop)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.poses import Array, Indices, Mask
from nscan_cli.slam.local_matching.options import NScanOptions


class Neighbours(NamedTuple):
    """The members of a match."""

    members: Indices
    """(n,) keyframes of the match, increasing."""
    from_other_visit: Mask
    """(n,) whether each is of another visit."""
    visits: int
    """Number of earlier visits here."""


def choose_neighbours(poses: Array, paths: Array, centre: int, options: NScanOptions) -> Neighbours:
    """Choose the members of a match about `centre`.

    Poses (K, 3) are global, paths (K,) are lengths of path. The nearest keyframes within the radius are
    taken. Half of the members are of other visits, unless the options leave these out. The first of the other
    visits are preferred: on repeated rounds, scans from other corridors would else give way to scans that see
    the same again.
    """
    first = options.max_other_visits if options.loops else 0
    squared = np.square(poses[:, 0] - poses[centre, 0]) + np.square(poses[:, 1] - poses[centre, 1])
    near = np.flatnonzero(squared <= options.radius**2)
    before = np.abs(paths[centre] - paths[near]) > options.visit_path
    left_out, visits = before.copy(), 0
    if first and before.any():
        earlier = paths[near[before]]
        visit = np.cumsum(np.diff(earlier, prepend=-np.inf) > options.visit_path)
        left_out[before] = visit > first
        visits = int(visit[near[before] < centre][-1:].sum())
    order = np.argsort(squared[near], kind="stable")
    order = order[~left_out[order]]
    others = order[before[order]]
    same = order[~before[order]][: options.max_scans - min(len(others), options.max_scans // 2)]
    chosen = np.sort(np.concatenate([same, others[: options.max_scans - len(same)]]))
    return Neighbours(near[chosen], before[chosen], visits)
