"""Stretches of a log in another unit than the others: of two drivers, or of one that was updated."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.text import shortened_list
from nscan_cli.logs.mask_runs import mask_runs, stretch_names
from nscan_cli.logs.range_unit import UNITS, RangeUnitOptions, scaled
from nscan_cli.logs.raw_scans import RawScans
from nscan_cli.logs.scan_order import ScanOrder
from nscan_cli.poses import Array, Indices, Mask


@dataclass(frozen=True)
class UnitStretchOptions:
    """When some scans of a log are in another unit than the others."""

    beams: int = 32
    """Approximate number of beams of a scan that are compared, evenly spread. More take longer."""
    min_readings: int = 6
    """Least number of compared readings of a scan that tell its unit; others count as the scan before. A
    larger value lets fewer scans tell."""
    max_same_share: float = 0.5
    """If more of the large readings than this share are one value, it is a code and no distance. A larger
    value corrects more logs."""
    tolerance: float = 0.15
    """Readings of successive scans are in two units if their ratio is that of the units to within this share.
    A larger value corrects more logs."""
    min_share: float = 0.5
    """Least share of the readings of two successive scans with that ratio, and least share of the changes
    that have it. A larger value corrects fewer logs."""
    least_factor: float = 1.8
    """Least factor by which the readings of two successive scans differ where the user is told. A smaller
    value tells more."""
    factor_tolerance: float = 0.08
    """The readings of two scans differ by one factor to within this share. A larger value tells more."""
    min_factor_share: float = 0.75
    """Least share of the readings of both scans that differ by one factor: 0.58 at most on real logs, for a
    factor of 1.5. A larger value tells less."""
    least_unknown_factor: float = 10.0
    """Stretches that are told by their usual readings alone, of which no unit is known, have this factor at
    least: the usual readings of two rooms differ by less. A larger value tells less."""
    min_factor_readings: int = 12
    """Least number of beams with a reading in both scans. A larger value tells less."""


def in_one_unit(
    raw: RawScans, order: ScanOrder, options: UnitStretchOptions = UnitStretchOptions()
) -> tuple[RawScans, list[str]]:
    """The scans in metres if those of some stretches are in metres and the others are not, and messages.

    `raw.ranges` may be overwritten.
    """
    rows, times = order.rows, order.times
    some = raw.ranges[rows, :: max(raw.ranges.shape[1] // options.beams, 1)]
    is_told = (some > 0) & np.isfinite(some)
    is_far = _are_most(some >= RangeUnitOptions.remote_median, is_told, options)
    if not is_far.any():
        return raw, _sudden_factors(some, is_told, times, options)
    is_near = _are_most(some <= RangeUnitOptions.max_median, is_told, options)
    far, near = some[is_far][is_told[is_far]], some[is_near][is_told[is_near]]
    if not near.size or np.unique(far, return_counts=True)[1].max() > options.max_same_share * far.size:
        return raw, _sudden_factors(some, is_told, times, options)
    # Between the two kinds there is nothing that a scan of one room could have.
    boundary = math.sqrt(float(np.median(near)) * float(np.median(far)))
    is_told_of = np.count_nonzero(is_told, axis=1) >= options.min_readings
    is_far = _as_before(_are_most(some > boundary, is_told, options), is_told_of)
    if is_far.all() or not is_far.any():
        return raw, []
    names = stretch_names((first, end - 1) for first, end in mask_runs(is_far))
    factor = float(np.median(far) / np.median(near))
    unit = _unit(some, is_told, is_far, factor, options)
    if unit is None and factor < options.least_unknown_factor:
        return raw, _sudden_factors(some, is_told, times, options)
    if unit is None:
        return raw, [
            f"the ranges of scans {names} are {factor:.3g} times the others: they are likely in another "
            "unit; " + _apart(times, int(np.flatnonzero(np.diff(is_far))[0]) + 1)
        ]
    name, scale = unit
    return _scaled_rows(raw, rows[is_far], scale), [
        f"the ranges of scans {names} are in {name}, the others in metres: they are multiplied by {scale:g}; "
        "--as-recorded leaves them as they are"
    ]


def _are_most(marked: Mask, is_told: Mask, options: UnitStretchOptions) -> Mask:
    """(S,) the scans with enough readings that count, `is_told` (S, B), most of which are `marked` (S, B)."""
    count = np.count_nonzero(is_told, axis=1)
    found: Mask = 2 * np.count_nonzero(marked & is_told, axis=1) > np.maximum(count, options.min_readings)
    return found


def _as_before(mask: Mask, is_told: Mask) -> Mask:
    """A mask (S,); rows that tell nothing have the value of the last row before that tells something."""
    tells = np.where(is_told, np.arange(len(mask)), -1)
    last = np.maximum.accumulate(tells)
    found: Mask = mask[np.where(last < 0, int(np.argmax(is_told)), last)]
    return found


def _unit(
    some: NDArray[np.float32], is_told: Mask, is_far: Mask, factor: float, options: UnitStretchOptions
) -> tuple[str, float] | None:
    """Name and metres of the unit of those scans that are far, if it is beyond doubt.

    Either most changes from one unit to the other show it. Or the usual readings, `factor` times the others,
    show it as those of a whole log do.
    """
    at = np.flatnonzero(np.diff(is_far.astype(np.int8)))
    both = is_told[at] & is_told[at + 1]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        off = np.abs(np.log(some[at + 1] / some[at]))
    sure = RangeUnitOptions()
    for name, scale in UNITS:
        has_ratio = both & (np.abs(off + math.log(scale)) < options.tolerance)
        shows = np.count_nonzero(has_ratio, axis=1) >= np.maximum(
            options.min_share * np.count_nonzero(both, axis=1), options.min_readings
        )
        if np.count_nonzero(shows) >= options.min_share * len(at):
            return name, scale
        others = [abs(math.log(factor * other)) for _, other in UNITS if other != scale]
        is_near = abs(math.log(factor * scale)) <= math.log(sure.certain_factor)
        if is_near and min(others) > math.log(sure.unlikely_factor):
            return name, scale
    return None


def _scaled_rows(raw: RawScans, rows: Indices, scale: float) -> RawScans:
    """The scans with the readings of some rows (n,), and their limits, in metres."""
    limits: list[Array] = [np.array(np.broadcast_to(limit, len(raw.ranges))) for limit in raw.limits]
    part = scaled(replace(raw, ranges=raw.ranges[rows], limits=(limits[0][rows], limits[1][rows])), scale)
    raw.ranges[rows] = part.ranges
    for whole, of_part in zip(limits, part.limits, strict=True):
        whole[rows] = of_part
    return replace(raw, limits=(limits[0], limits[1]))


def _sudden_factors(
    some: NDArray[np.float32], is_told: Mask, times: Array, options: UnitStretchOptions
) -> list[str]:
    """The messages where all readings (S, B) change by one factor from one scan to the next."""
    both = is_told[1:] & is_told[:-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.diff(np.log(some), axis=0)
    least = math.log(options.least_factor)
    count = np.count_nonzero(both, axis=1)
    is_odd = 2 * np.count_nonzero(both & (np.abs(logs) >= least), axis=1) > count
    found = []
    for row in np.flatnonzero(is_odd & (count >= options.min_factor_readings)).tolist():
        values = logs[row, both[row]]
        factor = float(np.median(values))
        share = np.count_nonzero(np.abs(values - factor) < options.factor_tolerance) / len(values)
        if abs(factor) >= least and share >= options.min_factor_share:
            found.append((row + 1, math.exp(factor)))
    if not found:
        return []
    names = shortened_list([f"{row} by {factor:.3g}" for row, factor in found], "more time")
    return [
        f"all ranges are multiplied from one scan to the next, at scan {names}: parts of the log are "
        f"likely in different units; {_apart(times, found[0][0])}"
    ]


def _apart(times: Array, row: int) -> str:
    """How to map what is before a row, and what begins with it."""
    between = f"{0.5 * (times[row - 1] + times[row]) - times[0]:.2f}"
    return f"map each part by itself: try --end {between}, or --start {between}"
