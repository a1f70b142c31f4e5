"""A reading that stands all over the scans: what a driver writes where the laser saw nothing.

Readings of walls have many values, those beside each other about as often as each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.logs.range_limits import RangeLimits


@dataclass(frozen=True)
class RepeatedReadingOptions:
    """When a reading that is repeated is no distance."""

    scans: int = 32
    """Number of scans that are looked at, evenly spread. More take longer."""
    min_values: int = 100
    """Least number of values of the readings: with fewer they are rounded. A larger number looks at fewer
    logs."""
    max_values: int = 3
    """Largest number of such values. A larger number leaves out more."""
    min_readings: int = 100
    """Least number of usable readings in these. A larger number looks at fewer logs."""
    min_share: float = 0.01
    """Least share of them that has exactly this value. It is 0.06 at most on real logs, where others beside
    it are as many. A larger value leaves less out."""
    max_share: float = 0.6
    """Greatest share: with a larger value more is left out, and less remains to make a map from."""
    near: float = 0.25
    """Readings within this distance are beside it, m. A larger value leaves less out."""
    ratio_to_near: float = 10.0
    """Least ratio to the number of any value beside it. It is 2 at most on real logs. A larger value leaves
    less out."""
    ratio_to_others: float = 3.0
    """Least ratio to the number of any other value: walls in ranges rounded to half a metre have nothing
    beside them. A larger value leaves less out."""
    min_beams: float = 0.25
    """Least share of the beams that have it in some of the scans. A larger value leaves less out."""
    always: float = 0.9
    """Beams that have it in a larger share of the scans do not count: they are dead, or see the robot."""


def repeated_readings(ranges: NDArray[np.float32], limits: RangeLimits) -> dict[float, float]:
    """The readings (m) among ranges (S, B) that are no distances, with their shares of the usable ones."""
    options = RepeatedReadingOptions()
    if not len(ranges):
        return {}
    rows = np.unique(np.linspace(0, len(ranges) - 1, options.scans).astype(np.int64))
    some = ranges[rows]
    values, counts = np.unique(some[_are_usable(some, limits.of(rows))], return_counts=True)
    total = int(counts.sum())
    if total < options.min_readings or len(values) < options.min_values:
        return {}
    order = np.argsort(-counts, kind="stable")
    for number in range(min(options.max_values, len(order)), 0, -1):
        those, others = order[:number], order[number:]
        shares = counts[those] / total
        if shares[-1] < options.min_share or shares.sum() > options.max_share:
            continue
        if all(_is_alone(k, others, values, counts, options) for k in those.tolist()) and all(
            _is_all_over(some == values[k], options) for k in those.tolist()
        ):
            return dict(zip(values[those].tolist(), shares.tolist(), strict=True))
    return {}


def _are_usable(ranges: NDArray[np.float32], limits: RangeLimits) -> NDArray[np.bool_]:
    """(S, B) which readings are within the limits of their scans."""
    low, high = (limit[:, None].astype(np.float32) for limit in (limits.low, limits.high))
    with np.errstate(invalid="ignore"):
        usable: NDArray[np.bool_] = (ranges > low) & (ranges < high)
    return usable


def _is_alone(
    k: int,
    others: NDArray[np.int64],
    values: NDArray[np.float32],
    counts: NDArray[np.int64],
    options: RepeatedReadingOptions,
) -> bool:
    """Whether a value is much more frequent than the others beside it, and more than any other."""
    beside = others[np.abs(values[others] - values[k]) <= options.near]
    near, any_other = (int(counts[some].max(initial=1)) for some in (beside, others))
    return bool(counts[k] >= max(options.ratio_to_near * near, options.ratio_to_others * any_other))


def _is_all_over(has_reading: NDArray[np.bool_], options: RepeatedReadingOptions) -> bool:
    """Whether many beams of scans (n, B) have a certain reading now and then."""
    shares = has_reading.mean(axis=0)
    sometimes = np.count_nonzero((shares > 0.0) & (shares <= options.always))
    return bool(sometimes >= options.min_beams * len(shares))


def without_repeated_readings(
    ranges: NDArray[np.float32], limits: RangeLimits
) -> tuple[NDArray[np.int64], list[str]]:
    """Write nan for usable readings among ranges (S, B) that are no distances, in place.

    Returns the number of such readings of each scan (S,), and the messages for the user.
    """
    found = repeated_readings(ranges, limits)
    if not found:
        return np.zeros(len(ranges), dtype=np.int64), []
    is_repeated = np.isin(ranges, np.array(list(found), dtype=np.float32)) & _are_usable(ranges, limits)
    counts = np.count_nonzero(is_repeated, axis=1).astype(np.int64)
    ranges[is_repeated] = np.nan
    listed = ", ".join(
        f"{share:.0%} of the readings are exactly {value:.4g} m" for value, share in found.items()
    )
    what = "it stands for no reading, and is" if len(found) == 1 else "they stand for no reading, and are"
    return counts, [
        f"{listed}, in all directions, and hardly any are about that: {what} left out; --as-recorded uses "
        "all readings"
    ]
