"""The choice of the keyframes that are matched with a keyframe (paper, V: step 3 of the loop)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel
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
    return Neighbours(
        *_choose(poses, paths, centre, options.radius, options.visit_path, first, options.max_scans)
    )


@kernel
def _choose(
    poses: Array, paths: Array, centre: int, radius: float, recent: float, first_visits: int, most: int
) -> tuple[Indices, Mask, int]:
    """The kernel of choose_neighbours. Keyframes more than `recent` (m) of path apart are of different
    visits."""
    near, distances = np.empty(len(poses), dtype=np.int64), np.empty(len(poses))
    before, left_out = np.empty(len(poses), dtype=np.bool_), np.empty(len(poses), dtype=np.bool_)
    n = visits = others = 0
    visit, last = -1, -np.inf
    for k in range(len(poses)):
        dx, dy = poses[k, 0] - poses[centre, 0], poses[k, 1] - poses[centre, 1]
        if abs(dx) > radius or abs(dy) > radius:
            continue
        distance = np.sqrt(dx * dx + dy * dy)
        if distance > radius:
            continue
        near[n], distances[n] = k, distance
        before[n] = left_out[n] = abs(paths[centre] - paths[k]) > recent
        if before[n] and first_visits > 0:
            visit += paths[k] - last > recent
            last = paths[k]
            left_out[n] = visit >= first_visits
            others += not left_out[n]
            if k < centre:
                visits = visit + 1
        n += 1
    order, chosen = np.argsort(distances[:n], kind="mergesort"), np.zeros(n, dtype=np.bool_)
    room = most - min(others, most // 2)
    taken = 0
    for of_before in (False, True):
        for at in order:
            if taken < room and before[at] == of_before and not left_out[at]:
                chosen[at] = True
                taken += 1
        room = most
    return near[:n][chosen], before[:n][chosen], visits
