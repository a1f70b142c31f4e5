"""What is guessed from one keyframe to the next, as a saved graph has it: nothing else in it says so.

Relations that are matched again there would be as sure as any other; see degenerate_relations.py.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nscan_cli.graph.model import Graph
from nscan_cli.poses import Array
from nscan_cli.slam.backend.degenerate_relations import guess_variances
from nscan_cli.slam.state import SlamState

SIGMAS = ("along", "place", "turn")
"""Keys of a guess: standard deviations along the way (m), of the place (m) and of the turn (rad)."""


def guessed_steps(state: SlamState) -> dict[str, Any]:
    """The guesses of a finished run for the provenance of its graph; empty if there is none."""
    variances, rows = guess_variances(state), state.route.rows.tolist()
    steps = [
        {"from": rows[at], "to": rows[at + 1]}
        | {key: math.sqrt(value) for key, value in zip(SIGMAS, variances[at].tolist(), strict=True) if value}
        for at in np.flatnonzero(variances.any(axis=1)).tolist()
    ]
    return {"guessed_steps": steps} if steps else {}


def guesses_of(graph: Graph) -> Array:
    """The variances (K − 1, 3) of what was guessed from each keyframe of a graph to the next.

    Raises ValueError if the provenance has something else in their place.
    """
    keyframes, steps = graph.keyframes.tolist(), graph.provenance.get("guessed_steps", [])
    variances = np.zeros((len(keyframes) - 1, 3))
    place = {node: at for at, node in enumerate(keyframes[:-1])}
    if not isinstance(steps, list):
        raise ValueError("guessed_steps is no list")
    for step in steps:
        first = step.get("from") if isinstance(step, dict) else None
        at = place.get(first) if isinstance(first, int) else None
        if at is None or step.get("to") != keyframes[at + 1]:
            raise ValueError(f"guessed_steps has {str(step)[:60]}, no step from one keyframe to the next")
        sigmas = [step.get(key, 0.0) for key in SIGMAS]
        if not all(isinstance(sigma, (int, float)) and 0.0 <= sigma < math.inf for sigma in sigmas):
            raise ValueError(f"guessed_steps has {str(step)[:60]}, without standard deviations")
        variances[at] = np.square(sigmas)
    return variances
