"""Derivatives by differences, for functions that are smooth in pieces."""

from __future__ import annotations

from collections.abc import Callable, Hashable

import numpy as np

from nscan_cli.poses import Array

STEPS = (-2, -1, 1, 2)


def derivative(
    function: Callable[[Array], Array | float],
    piece: Callable[[Array], Hashable],
    at: Array,
    steps: Array,
) -> Array | None:
    """∂function/∂p at `at` (m,) by differences of fourth order; one row for each variable.

    `piece` names the smooth piece of the function that a place belongs to. None when a place that the
    differences need lies in another piece than `at`: there they would mean nothing.
    """
    here, rows = piece(at), []
    for variable, step in enumerate(steps):
        values = []
        for multiple in STEPS:
            place = at.copy()
            place[variable] += multiple * step
            if piece(place) != here:
                return None
            values.append(np.asarray(function(place)))
        rows.append((8 * (values[2] - values[1]) - (values[3] - values[0])) / (12 * step))
    return np.array(rows)
