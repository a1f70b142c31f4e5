"""Scans of logs that write the bearing of every beam: the first direction and the step that these make."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.files.limits import BEAMS
from nscan_cli.poses import Array, Indices

FINEST = 6
"""Decimals; bearings are not written finer than that."""
UNEVEN = 0.05
"""Of a step: what a bearing may be off its place, beside what rounding does."""


class EvenBearings(NamedTuple):
    """The directions of a scan's readings, evenly spaced; some may have been left out."""

    first: float
    """rad"""
    step: float
    """rad; negative where the beams run clockwise."""
    places: Indices
    """(n,) which direction each reading has, counted from 0; increasing."""


def are_degrees(greatest: Array) -> bool:
    """Whether bearings are in degrees, from the greatest size (S,) that each of the scans has.

    No bearing in rad is beyond a whole turn. A laser that sees less than 6° to each side is none.
    """
    return bool(len(greatest)) and float(np.median(greatest)) > 2 * np.pi + 0.01


def even_bearings(bearings: Array, in_degrees: bool) -> EvenBearings | None:
    """The fan of bearings (n,) as written, or None when they are not evenly spaced.

    Hundredths of a degree, which Player has inside, are restored where the log has rounded them.
    """
    turn = 360.0 if in_degrees else 2 * np.pi
    to_radians = np.pi / 180 if in_degrees else 1.0
    rounding = _rounding(bearings)
    bearings = np.unwrap(bearings, period=turn)
    if len(bearings) == 1:
        return EvenBearings(float(bearings[0]) * to_radians, np.pi / 180, np.zeros(1, dtype=np.int64))
    for places in (np.arange(len(bearings)), _with_gaps(bearings, turn)):
        if places is None:
            continue
        first, step = _line(places, bearings)
        off = float(np.abs(first + step * places - bearings).max())
        if step != 0 and off <= rounding + UNEVEN * abs(step):
            hundredths = np.round(np.degrees(np.array([first, step]) * to_radians), 2)
            restored = np.radians(hundredths) / to_radians
            if restored[1] and np.abs(restored[0] + restored[1] * places - bearings).max() <= rounding:
                first, step = restored
            return EvenBearings(float(first) * to_radians, float(step) * to_radians, places)
    return None


def _rounding(values: Array) -> float:
    """The last decimal that any of the values has."""
    for decimals in range(FINEST):
        scaled = values * 10.0**decimals
        if np.allclose(scaled, np.rint(scaled), rtol=0, atol=1e-6):
            return float(10.0**-decimals)
    return float(10.0**-FINEST)


def _with_gaps(bearings: Array, turn: float) -> Indices | None:
    """The places of bearings of which some in between were left out; None where two would share one."""
    usual = float(np.median(np.diff(bearings)))
    most = min(BEAMS.value, 1 + turn / abs(usual)) if usual else 0
    if not usual or abs(bearings[-1] - bearings[0]) > most * abs(usual):
        return None
    places: Indices = np.rint((bearings - bearings[0]) / usual).astype(np.int64)
    return places if (np.diff(places) > 0).all() else None


def _line(places: Indices, bearings: Array) -> tuple[float, float]:
    """Bearing at place 0, and from place to place, of the line that fits best."""
    middle = places.mean()
    off = places - middle
    step = float(off @ (bearings - bearings.mean()) / (off @ off))
    return float(bearings.mean() - step * middle), step
