"""The minimum of sampled values, by the parabola through the samples beside the least one."""

from __future__ import annotations

import numpy as np

from nscan_cli.poses import Array


def parabola_minimum(places: Array, values: Array, beside: int = 1) -> float:
    """The place of the minimum of values (n,) at places (n,), by a least-squares parabola.

    It is fitted to the least value and to the `beside` values on each side of it. The place of the least
    value, if the parabola has no minimum.
    """
    best = int(np.argmin(values))
    near = slice(max(best - beside, 0), best + beside + 1)
    bend, slope, _ = np.polyfit(places[near] - places[best], values[near], 2).tolist()
    return float(places[best]) - (slope / (2 * bend) if bend > 0.0 else 0.0)
