"""Odometry in millimetres or centimetres over a part of a log: two drivers, or one that was updated."""

from __future__ import annotations

import numpy as np

from nscan_cli.calibration.changed_odometry import with_scaled_steps
from nscan_cli.calibration.measured_steps import measure_steps
from nscan_cli.calibration.odometry_options import OdometryUnitOptions
from nscan_cli.calibration.step_options import StepOptions
from nscan_cli.calibration.step_sampling import possible_steps
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.mask_runs import mask_runs, stretch_names
from nscan_cli.logs.range_unit import UNITS
from nscan_cli.poses import Indices, Mask, relative


def checked_units(
    log: LaserLog, options: OdometryUnitOptions, steps: StepOptions
) -> tuple[LaserLog, list[str]]:
    """The log with all of its odometry in metres if a part is in another unit, and the messages."""
    if log.odometry is None or len(log) < 2:
        return log, []
    lengths = np.hypot(*np.nan_to_num(relative(log.odometry[1:], log.odometry[:-1]))[:, :2].T)
    periods = np.diff(log.times)
    is_fast, moves = lengths > options.too_fast * periods, lengths > options.still * periods
    if min(np.count_nonzero(is_fast), np.count_nonzero(moves & ~is_fast)) < options.min_steps:
        return log, []
    # A step from one frame to another may be of any length, and a slow robot is not too fast in centimetres.
    usual = [float(np.median(lengths[some])) for some in (moves & ~is_fast, is_fast)]
    is_large = _as_most(lengths > np.sqrt(usual[0] * usual[1]), moves, options)
    parts = [metres_by_scans(log, some, options, steps) for some in (moves & ~is_large, moves & is_large)]
    for name, scale in UNITS:
        if all(
            part is not None and abs(np.log(part / unit)) < options.tolerance
            for part, unit in zip(parts, (1.0, scale), strict=True)
        ):
            stretches = mask_runs(is_large)
            names = stretch_names(
                (log.numbers[first + (first > 0)], log.numbers[end]) for first, end in stretches
            )
            times = [(float(log.times[first]), float(log.times[end])) for first, end in stretches]
            return with_scaled_steps(log, times, scale), [
                f"odometry from scan {names} is in {name}, elsewhere in metres: it is multiplied by "
                f"{scale:g} there; --as-recorded uses it as it is"
            ]
    return log, []


def _as_most(is_large: Mask, moves: Mask, options: OdometryUnitOptions) -> Mask:
    """(n,) which steps are large: most of the steps with motion about each of them are.

    So a single large step does not count. A large step beside such ones does.
    """
    at = np.flatnonzero(moves)
    most = _about_each(is_large[at], options.beside) >= options.most_beside
    most |= is_large[at] & (_about_each(most, options.beside) > 0)
    return most[np.clip(np.searchsorted(at, np.arange(len(moves))), 0, len(at) - 1)]


def _about_each(mask: Mask, beside: int) -> Indices:
    """(n,) how many of each row and those `beside` it, so many on both sides, are marked in a mask (n,).

    SciPy has filters for this, but importing these takes longer than all else that this check does.
    """
    padded = np.pad(mask.astype(np.int64), beside, mode="edge")
    return np.convolve(padded, np.ones(2 * beside + 1, dtype=np.int64), "valid")


def metres_by_scans(
    log: LaserLog, chosen: Mask, options: OdometryUnitOptions, steps: StepOptions
) -> float | None:
    """Metres by scans for one metre by odometry, in the median of `chosen` steps (n,); None for too few."""
    assert log.odometry is not None
    first, last = possible_steps(log, steps)
    before = np.append(0, np.cumsum(chosen))
    whole = before[last] - before[first] == last - first
    first, last = first[whole], last[whole]
    if not len(first):
        return None
    some = np.unique(np.linspace(0, len(first) - 1, options.measured_steps).astype(np.int64))
    found = measure_steps(log, (first[some], last[some]), steps)
    by_scans = np.hypot(*found.laser[:, :2].T)
    by_odometry = np.hypot(*found.odometry(log.odometry)[:, :2].T)
    clear = (by_scans >= steps.min_motion) & (by_odometry > 0.0)
    if np.count_nonzero(clear) < options.min_measured:
        return None
    return float(np.median(by_scans[clear] / by_odometry[clear]))
