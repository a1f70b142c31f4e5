"""What a scan predicts of the next one: its end points, as seen from where the laser has moved."""

from __future__ import annotations

import numpy as np

from nscan_cli.poses import Array, Indices, Mask


def predicted_ranges(lengths: Array, angles: Array, steps: Array) -> tuple[Array, Array]:
    """Ranges and directions (n, B), rad, of the end points of n scans behind steps (n, 3) of the laser.

    The scans have `lengths` (n, B) along `angles` (n or 1, B), rad; in the unit of the steps.
    """
    x, y = lengths * np.cos(angles) - steps[:, :1], lengths * np.sin(angles) - steps[:, 1:2]
    return np.sqrt(x * x + y * y), np.arctan2(y, x) - steps[:, 2:]


def beams_along(directions: Array, first: Array, between: Array, beams: int) -> tuple[Indices, Mask]:
    """The beams (n, B) of scans that look along `directions` (n, B), rad, and whether they have such (n, B).

    A scan has so many beams from a `first` direction (n or 1, 1) on, each turned by an angle `between`.
    """
    places = np.rint((directions - first) / between)
    around = np.round(2 * np.pi / np.abs(between))
    # `%` takes six times as long.
    places -= around * np.floor(places / around)
    has: Mask = places < beams
    return np.where(has, places, 0.0).astype(np.int64), has
