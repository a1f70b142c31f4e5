"""Association of the poses of two trajectories by time."""

from __future__ import annotations

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.evaluation.options import EvaluationOptions
from nscan_cli.files.text import counted
from nscan_cli.logs.scan_order import nearest_in_time
from nscan_cli.poses import Array, Indices


def mutual_nearest(
    times: Array, reference: Array, tolerance: float = EvaluationOptions.tolerance
) -> tuple[Indices, Indices]:
    """Rows of `times` and of `reference`, pair by pair, that are each other's nearest, at most `tolerance`
    apart.

    Each row occurs at most once. Both times must not decrease.
    """
    rows = np.arange(len(times))
    partner = nearest_in_time(reference, times)
    back = nearest_in_time(times, reference)[partner]
    pairs = (back == rows) & (np.abs(reference[partner] - times) <= tolerance)
    return rows[pairs], partner[pairs]


def no_match(
    result: str, times: Array, reference: str, reference_times: Array, fits: str = ""
) -> InputDataError:
    """The error that a result has no stamp in common with its reference, with the spans of both.

    `fits` is the end of the sentence, such as a lag with which they would match.
    """
    a, b, c, d = times.min(), times.max(), reference_times.min(), reference_times.max()
    problem = (
        f"no stamp of {reference} lies within {EvaluationOptions.tolerance} s of it; "
        f"the result spans {a:.3f} to {b:.3f} s ({counted(len(times), 'pose')}), "
        f"the reference {c:.3f} to {d:.3f} s ({counted(len(reference_times), 'stamp')}), "
        f"{c - a:+.3f} s off at the start{fits}"
    )
    return InputDataError(result, problem, "give the reference of this log, in the same clock")
