"""First direction and step of a scan whose log writes the bearing of every beam."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.files.limits import BEAMS
from nscan_cli.logs.text.text_log_options import TextLogOptions
from nscan_cli.poses import Array, Indices

MAX_RADIANS = 2 * np.pi + 0.01
"""The largest size of a heading or bearing in rad, which its log has rounded."""


class EvenBearings(NamedTuple):
    """Evenly spaced directions of the readings of a scan, possibly with gaps."""

    first: float
    """rad"""
    step: float
    """rad; negative if the beams run clockwise"""
    places: Indices
    """(n,) index of the direction of each reading, from 0, increasing"""


def are_degrees(greatest: Array) -> bool:
    """Whether bearings are in degrees, from the largest size (S,) of the bearings of each scan.

    A bearing in rad is at most 2π. A laser that sees less than 6° to each side is not expected.
    """
    return bool(len(greatest)) and float(np.median(greatest)) > MAX_RADIANS


def even_bearings(bearings: Array, in_degrees: bool) -> EvenBearings | None:
    """The even spacing of bearings (n,) as written, or None if they are not evenly spaced.

    Player has hundredths of a degree internally. They are restored if the log has rounded them.
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
        first, step = _fitted_line(places, bearings)
        off = float(np.abs(first + step * places - bearings).max())
        if step != 0 and off <= rounding + TextLogOptions.max_unevenness * abs(step):
            hundredths = np.round(np.degrees(np.array([first, step]) * to_radians), 2)
            restored = np.radians(hundredths) / to_radians
            if restored[1] and np.abs(restored[0] + restored[1] * places - bearings).max() <= rounding:
                first, step = restored
            return EvenBearings(float(first) * to_radians, float(step) * to_radians, places)
    return None


def _rounding(values: Array) -> float:
    """The value of the last decimal that any of the values has."""
    most = TextLogOptions.max_decimals
    for decimals in range(most):
        scaled = values * 10.0**decimals
        if np.allclose(scaled, np.rint(scaled), rtol=0, atol=1e-6):
            return float(10.0**-decimals)
    return float(10.0**-most)


def _with_gaps(bearings: Array, turn: float) -> Indices | None:
    """The places of bearings with gaps between them; None if two bearings would share a place."""
    spacing = float(np.median(np.diff(bearings)))
    max_places = min(BEAMS.value, 1 + turn / abs(spacing)) if spacing else 0
    if not spacing or abs(bearings[-1] - bearings[0]) > max_places * abs(spacing):
        return None
    places: Indices = np.rint((bearings - bearings[0]) / spacing).astype(np.int64)
    return places if (np.diff(places) > 0).all() else None


def _fitted_line(places: Indices, bearings: Array) -> tuple[float, float]:
    """Bearing at place 0 and step between places, of the least-squares line."""
    middle = places.mean()
    off = places - middle
    step = float(off @ (bearings - bearings.mean()) / (off @ off))
    return float(bearings.mean() - step * middle), step
