"""How far poses are off the steady way between others, and how far a robot may be off it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.scan_order import usual_period
from nscan_cli.poses import Array, Indices, Mask, wrap

Places = tuple[int, int, int]
"""How many rows behind a given one the pose before, the pose itself, and the pose behind are."""


def differ_from_last(rows: NDArray[Any]) -> Mask:
    """(n,) which of rows (n, d) differ from the one before; the first one does."""
    differ: Mask = np.ones(len(rows), dtype=np.bool_)
    differ[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    return differ


def new_poses(poses: Array, times: Array) -> Indices:
    """(m,) the rows of poses (n, 3) at times (n,), s, that differ from the ones before and are later."""
    is_new = differ_from_last(poses)
    is_new[1:] &= times[1:] > times[:-1]
    return np.flatnonzero(is_new)


def farthest_by_force(spans: Array, acceleration: float) -> Array:
    """(n, 2) how far, m and rad, a robot may be off a steady way that takes so long (n,), s.

    It has this greatest acceleration, m/s² and rad/s².

    Over a long time it may turn by more than half a circle, which looks like a turn the other way: inf.
    """
    farthest = np.repeat(0.125 * spans[:, None] ** 2 * acceleration, 2, axis=1)
    farthest[farthest[:, 1] > 0.5 * np.pi, 1] = np.inf
    return farthest


def off_steady_way(poses: Array, times: Array, places: Places) -> Array:
    """(n, 3) how far each of poses (P, 3) at times (P,), s, is off the steady way between two others, m, rad.

    There are as many rows as have all three places.
    """
    before, at, behind = _slices(len(poses), places)
    share = ((times[at] - times[before]) / (times[behind] - times[before]))[:, None]
    way, step = poses[behind] - poses[before], poses[at] - poses[before]
    way[:, 2], step[:, 2] = wrap(way[:, 2]), wrap(step[:, 2])
    off: Array = step - share * way
    return off


def are_regular(times: Array, places: Places, most: float) -> Mask:
    """(n,) whether the times (P,), s, of poses at such places are apart as usual, within a factor `most`.

    Elsewhere poses may be in the wrong order.
    """
    before, at, behind = _slices(len(times), places)
    periods = np.stack([times[at] - times[before], times[behind] - times[at]])
    periods /= np.diff(places)[:, None] * (usual_period(times) or 1.0)
    is_usual: Mask = (periods >= 1.0 / most) & (periods <= most)
    regular: Mask = np.all(is_usual, axis=0)
    return regular


def _slices(size: int, places: Places) -> list[slice]:
    count = size - max(places)
    return [slice(place, place + count) for place in places]
