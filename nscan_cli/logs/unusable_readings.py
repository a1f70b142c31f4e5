"""The number of usable readings of a log, why others are unusable, and the warning if few are usable."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.errors import InputDataError
from nscan_cli.logs.range_limits import RangeLimits
from nscan_cli.logs.range_peaks import RangeLimitOptions
from nscan_cli.logs.range_unit import wrong_unit
from nscan_cli.poses import Array

ROWS_AT_ONCE = 4096
"""Scans that are counted together, to save memory."""


class UnusableReadings(NamedTuple):
    """The unusable readings of a log."""

    counts: dict[str, int]
    """Number of unusable readings by reason"""
    warnings: list[str]
    unusable: InputDataError | None
    """The error to raise if no reading is usable"""


def unusable_readings(
    ranges: NDArray[np.float32], beams: NDArray[np.int64], limits: RangeLimits, file: str
) -> UnusableReadings:
    """The number of unusable readings among those (S, B; m) as written, of which scans have `beams` (S,)."""
    wrong = limits.low >= limits.high
    low, high = _limit_texts(limits) if wrong.all() else _limit_texts(limits.of(np.flatnonzero(~wrong)))
    lower, upper = _limit_texts(limits.of(np.flatnonzero(wrong))) if wrong.any() else (low, high)
    crossed = f"in scans whose lower limit, {lower}, is not below the upper, {upper}"
    # The option that changes the limit which makes readings unusable.
    options_by_reason = {
        f"nearer than {low}": "--min-range",
        f"beyond {high}": "--max-range",
        crossed: "--min-range and --max-range",
    }
    reasons = ("not a number", "0 or less", "infinite", *options_by_reason)
    found = zip(reasons, _counts(ranges, beams, limits).tolist(), strict=True)
    counts = {reason: count for reason, count in found if count}
    total, lost = int(beams.sum()), sum(counts.values())
    found_unit = wrong_unit(ranges, limits)
    unit, remedy = ("", "") if found_unit is None else (f"; {found_unit.seems}", found_unit.remedy)
    if lost <= RangeLimitOptions.max_lost_share * total and not unit:
        told = f"{counts.get(crossed, 0):,} of {_readings(total)} are unusable: {crossed}"
        return UnusableReadings(counts, [told] if crossed in counts else [], None)
    listed = ", ".join(f"{n:,} {'is' if n == 1 else 'are'} {why}" for why, n in counts.items()) + unit
    most = max(counts, key=lambda reason: counts[reason], default="")
    met_nothing = most == f"beyond {high}" and limits.no_return == limits.whole[1]
    if not remedy and most in options_by_reason and not met_nothing:
        remedy = f"if they are valid, set {options_by_reason[most]}"
    if lost < total:
        few = "only " if lost > RangeLimitOptions.max_lost_share * total else ""
        said = f"{few}{total - lost:,} of {_readings(total)} are usable" + (f": {listed}" if counts else unit)
        return UnusableReadings(counts, [f"{said}; {remedy}" if remedy else said], None)
    options = [option for option in ("--min-range", "--max-range") if f"({option})" in most]
    if options:
        remedy = f"choose another {' and '.join(options)}"
    problem = f"none of its {_readings(total)} is usable: {listed}"
    remedy = remedy or "give a log with valid readings"
    return UnusableReadings(counts, [], InputDataError(file, problem, remedy))


def _counts(ranges: NDArray[np.float32], beams: NDArray[np.int64], limits: RangeLimits) -> NDArray[np.int64]:
    """(6,) number of unusable readings for each reason."""
    found = np.zeros(6, dtype=np.int64)
    found[0] = beams.sum() - ranges.size
    for first in range(0, len(ranges), ROWS_AT_ONCE):
        rows = slice(first, first + ROWS_AT_ONCE)
        crossed = limits.low[rows] >= limits.high[rows]
        low, high = (values[rows][~crossed, None].astype(np.float32) for values in limits[:2])
        part = ranges[rows][~crossed]
        infinite = part == np.inf
        nearer, beyond = (part > 0) & ~(part > low), (part >= high) & ~infinite
        found += [
            np.count_nonzero(np.isnan(part)), np.count_nonzero(part <= 0), np.count_nonzero(infinite),
            np.count_nonzero(nearer), np.count_nonzero(beyond & ~nearer), beams[rows][crossed].sum(),
        ]  # fmt: skip
        # Beams that a scan with crossed limits does not have are no readings either.
        found[0] += crossed.sum() * ranges.shape[1] - beams[rows][crossed].sum()
    return found


def _readings(count: int) -> str:
    return "1 reading" if count == 1 else f"{count:,} readings"


def _limit_texts(limits: RangeLimits) -> tuple[str, str]:
    return (f"{_metres(limits.low)} ({limits.low_from})", f"{_metres(limits.high)} ({limits.high_from})")


def _metres(limit: Array) -> str:
    low, high = float(limit.min()), float(limit.max())
    return f"{high:g} m" if low == high else f"{low:g} m to {high:g} m"
