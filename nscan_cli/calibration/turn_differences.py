"""How far turns by scans are off those by odometry, if its stamps are moved."""

from __future__ import annotations

import numpy as np

from nscan_cli.poses import Array


def turn_differences(
    odometry: tuple[Array, Array], steps: tuple[Array, Array], turned: Array, offsets: Array
) -> Array:
    """(O, n) differences of turns (n,) and those by odometry, rad, for each of the offsets (O,), s, that are
    added to its stamps.

    `odometry` are its stamps (P,), s, and unwrapped headings (P,), `steps` the times at which the turns begin
    (n,) and end (n,).
    """
    (at, headings), (begins, ends) = odometry, steps
    told = np.interp(ends - offsets[:, None], at, headings)
    told -= np.interp(begins - offsets[:, None], at, headings)
    return np.abs(told - turned)
