"""The terms of a graph once more, in plain NumPy that also takes complex numbers: for derivatives.

The derivative of f is Im f(x + ih)/h with a tiny h, exact to rounding (complex step); second derivatives
are central differences of it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from nscan_cli.graph.model import NScan, Pairwise


def wrapped(angle: Any) -> Any:
    return angle - 2 * np.pi * np.round(np.real(angle) / (2 * np.pi))


def pairwise_error(x: Any, relation: Pairwise) -> Any:
    """Eqs. (2) and (16) for the poses x (2, 3), a and b."""
    (xa, ya, fa), (xb, yb, fb) = x
    z = relation.measurement
    return np.array(
        [
            (xb - xa) * np.cos(fa) + (yb - ya) * np.sin(fa) - z[0],
            -(xb - xa) * np.sin(fa) + (yb - ya) * np.cos(fa) - z[1],
            wrapped(fb - fa - z[2]),
        ]
    )


def nscan_error(x: Any, relation: NScan) -> Any:
    """Eqs. (19) to (22) for the poses x (n, 3)."""
    c, p = relation.fixed, relation.poses
    theta = p[c, 2] - x[c, 2]
    rows = [
        (
            np.cos(theta) * (x[i, 0] - x[c, 0]) - np.sin(theta) * (x[i, 1] - x[c, 1]) + p[c, 0] - p[i, 0],
            np.sin(theta) * (x[i, 0] - x[c, 0]) + np.cos(theta) * (x[i, 1] - x[c, 1]) + p[c, 1] - p[i, 1],
            wrapped(theta + x[i, 2] - p[i, 2]),
        )
        for i in range(len(x))
    ]
    return np.array(rows).ravel()


def term(x: Any, relation: Pairwise | NScan) -> Any:
    """Eq. (17) or (23)."""
    if isinstance(relation, Pairwise):
        error, weight = pairwise_error(x, relation), relation.information
    else:
        error, weight = nscan_error(x, relation), relation.hessian
    return error @ weight @ error


def derivative(f: Callable[[Any], Any], x: Any) -> Any:
    """∂f/∂x, (…, x.size), by complex steps."""
    columns = []
    for index in range(x.size):
        step = np.zeros(x.size)
        step[index] = 1e-30
        columns.append(np.imag(f(x + 1j * step.reshape(x.shape))) / 1e-30)
    return np.stack(columns, axis=-1)


def second_derivative(f: Callable[[Any], Any], x: Any, h: float = 1e-5) -> Any:
    """∂²f/∂x², (x.size, x.size), central differences of the complex-step gradient."""
    rows = []
    for index in range(x.size):
        step = np.zeros(x.size)
        step[index] = h
        step = step.reshape(x.shape)
        rows.append((derivative(f, x + step) - derivative(f, x - step)) / (2 * h))
    return np.array(rows)
