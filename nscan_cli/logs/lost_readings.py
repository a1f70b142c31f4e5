"""How many readings of a log count, why the others do not, and what to say where these are nearly all."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.errors import InputDataError
from nscan_cli.logs.range_limits import RangeLimits
from nscan_cli.poses import Array

ROWS = 4096
NEARLY_ALL = 0.9
READING_UNITS = (("millimetres", 1000), ("centimetres", 100))
NEAREST, USUAL, FARTHEST_USUAL = 0.2, 3.0, 40.0
"""m; about what half of a laser's readings lie below."""
REMOTE = 100.0
"""m; half of no planar laser's readings lie beyond."""
SAMPLE = 1 << 20


class Lost(NamedTuple):
    """What became of a log's readings."""

    counts: dict[str, int]
    """Why a reading does not count → how many there are of them."""
    warnings: list[str]
    unusable: InputDataError | None
    """What is wrong where none counts."""


def lost_readings(
    ranges: NDArray[np.float32], beams: NDArray[np.int64], limits: RangeLimits, file: str
) -> Lost:
    """What becomes of readings (S, B; m) as they are in the log; a scan has so many of them (S,)."""
    wrong = limits.low >= limits.high
    low, high = _said(limits) if wrong.all() else _said(limits.of(np.flatnonzero(~wrong)))
    lower, upper = _said(limits.of(np.flatnonzero(wrong))) if wrong.any() else (low, high)
    crossed = f"in scans whose lower limit, {lower}, is not below the upper, {upper}"
    # What a user may say about limits that leave too little.
    asked = {
        f"nearer than {low}": "--min-range",
        f"beyond {high}": "--max-range",
        crossed: "--min-range and --max-range",
    }
    reasons = ("not a number", "0 or less", "infinite", *asked)
    found = zip(reasons, _counts(ranges, beams, limits).tolist(), strict=True)
    counts = {reason: count for reason, count in found if count}
    total, lost = int(beams.sum()), sum(counts.values())
    unit, remedy = _unit(ranges, limits)
    if lost <= NEARLY_ALL * total and not unit:
        told = f"{counts.get(crossed, 0):,} of {_readings(total)} are {crossed}: they do not count"
        return Lost(counts, [told] if crossed in counts else [], None)
    listed = ", ".join(f"{n:,} {'is' if n == 1 else 'are'} {why}" for why, n in counts.items()) + unit
    most = max(counts, key=lambda reason: counts[reason], default="")
    met_nothing = most == f"beyond {high}" and limits.no_return == limits.whole[1]
    if not remedy and most in asked and not met_nothing:
        remedy = f"if they are good, say so by {asked[most]}"
    if lost < total:
        few = "only " if lost > NEARLY_ALL * total else ""
        said = f"{few}{total - lost:,} of {_readings(total)} count" + (f": {listed}" if counts else unit)
        return Lost(counts, [f"{said}; {remedy}" if remedy else said], None)
    options = [option for option in ("--min-range", "--max-range") if f"({option})" in most]
    if options:
        remedy = f"choose another {' and '.join(options)}"
    problem = f"none of its {_readings(total)} counts: {listed}"
    remedy = remedy or "give a log whose laser has measured something"
    return Lost(counts, [], InputDataError(file, problem, remedy))


def _counts(ranges: NDArray[np.float32], beams: NDArray[np.int64], limits: RangeLimits) -> NDArray[np.int64]:
    """(6,) how many readings do not count for each reason; some scans at a time, for memory."""
    found = np.zeros(6, dtype=np.int64)
    found[0] = beams.sum() - ranges.size
    for first in range(0, len(ranges), ROWS):
        rows = slice(first, first + ROWS)
        crossed = limits.low[rows] >= limits.high[rows]
        low, high = (values[rows][~crossed, None].astype(np.float32) for values in limits[:2])
        part = ranges[rows][~crossed]
        infinite = part == np.inf
        nearer, beyond = (part > 0) & ~(part > low), (part >= high) & ~infinite
        found += [
            np.count_nonzero(np.isnan(part)), np.count_nonzero(part <= 0), np.count_nonzero(infinite),
            np.count_nonzero(nearer), np.count_nonzero(beyond & ~nearer), beams[rows][crossed].sum(),
        ]  # fmt: skip
        # What a scan of the crossed limits lacks is no reading of its own either.
        found[0] += crossed.sum() * ranges.shape[1] - beams[rows][crossed].sum()
    return found


def _unit(ranges: NDArray[np.float32], limits: RangeLimits) -> tuple[str, str]:
    """In words, the unit that the readings seem to have, and the remedy; empty for metres or where none fits.

    Half of the returns lie beyond the limits, or farther than half of a laser's do, and all but a
    quarter would be within in another unit.
    """
    some = ranges.reshape(-1)[:: -(-ranges.size // SAMPLE)]
    end = np.inf if limits.no_return is None else limits.no_return
    some = some[(some > 0) & (some < end) & np.isfinite(some)]
    if not some.size:
        return "", ""
    median, most = (float(value) for value in np.quantile(some, (0.5, 0.75)))
    highest = float(limits.high.max())
    if median < min(highest, REMOTE):
        return "", ""
    fitting = [
        (abs(math.log(median / factor / USUAL)), name, factor)
        for name, factor in READING_UNITS
        if NEAREST <= median / factor <= FARTHEST_USUAL and most / factor < highest
    ]
    if not fitting:
        return "", ""
    _, name, factor = min(fitting)
    seem = f"; half of the returns are beyond {median:,.0f}, which looks like {name}"
    return seem, f"the ranges of a scan are metres: divide them by {factor:,} and write the log again"


def _readings(count: int) -> str:
    return "1 reading" if count == 1 else f"{count:,} readings"


def _said(limits: RangeLimits) -> tuple[str, str]:
    """Both limits in words, and where they are from."""
    return (
        f"{_metres(limits.low)} ({limits.low_from})",
        f"{_metres(limits.high)} ({limits.high_from})",
    )


def _metres(limit: Array) -> str:
    low, high = float(limit.min()), float(limit.max())
    return f"{high:g} m" if low == high else f"{low:g} m to {high:g} m"
