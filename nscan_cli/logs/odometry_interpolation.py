"""Poses of the robot at the times of the scans, from poses at other times; none where none are near."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.files.text import counted, shortened_list
from nscan_cli.logs.mask_runs import mask_runs
from nscan_cli.logs.robot_path import RobotPath, RobotPathOptions, poses_at
from nscan_cli.logs.scan_order import nearest_in_time, usual_period
from nscan_cli.poses import Array, Mask, relative, wrap


@dataclass(frozen=True)
class OdometryGapOptions:
    """When two poses of the odometry have a gap between them, over which nothing is interpolated."""

    periods: float = 10.0
    """A gap is longer than this many median periods of the poses. A larger value interpolates over more."""
    motion: float = 0.2
    """The robot moves by more than this over a gap, m and rad. A robot that stands may send no pose: what is
    interpolated then is right. A larger value interpolates over more."""
    beyond: float = 1.0
    """Periods from a pose, into a gap or beyond the first and the last, during which it is used. A larger
    value lets the robot stand longer there."""


def interpolated_poses(times: Array, at: Array, poses: Array, name: str, warnings: list[str]) -> Array | None:
    """Poses (S, 3) at `times` (S,), interpolated between `poses` (P, 3) at the sorted times `at` (P,).

    Linear in x, y and the unwrapped angle; nan far beyond the first and the last pose, and in gaps between
    poses. Near a pose there, that one is used.
    Returns None, with a warning, if no scan has a pose. `name` is what warnings call a pose. Times in s.
    """
    if (times > at[-1]).all() or (times < at[0]).all():
        warnings.append(
            f"no scan lies between the first {name} ({at[0]:.3f} s) and the last ({at[-1]:.3f} s): the scans "
            f"go from {times[0]:.3f} s to {times[-1]:.3f} s; no odometry"
        )
        return None
    columns = (poses[:, 0], poses[:, 1], np.unwrap(poses[:, 2]))
    found = np.stack([np.interp(times, at, column) for column in columns], axis=-1)
    found[:, 2] = wrap(found[:, 2])
    missing = _fill_gaps(found, times, at, poses) | _is_beyond(times, at, _margin(at))
    if missing.any():
        found[missing] = np.nan
        warnings.append(_missing_notice(missing, times, name))
    return found


def moved_odometry(is_known: Mask, path: RobotPath, times: Array) -> Array:
    """The odometry (S, 3) of scans at other `times` (S,), s, by its path: nan where none is known (S,), in
    gaps, and far beyond the first and the last pose, up to which the robot goes on as on the path.

    A scan that comes to lie in a gap has no more odometry than if it had been read there: how the robot came
    from one end of a gap to the other is not known.
    """
    found = poses_at(path, times)
    missing = _fill_gaps(found, times, path.times, path.poses) | ~is_known
    missing |= _is_beyond(times, path.times, RobotPathOptions.longest_step)
    found[missing] = np.nan
    return found


def _fill_gaps(found: Array, times: Array, at: Array, poses: Array) -> Mask:
    """Let the poses `found` (S, 3) at `times` (S,) that lie in gaps be the nearest of poses (P, 3) at (P,).

    Returns which (S,) have none near.
    """
    in_gap, nearest = _in_gap(times, at, poses), nearest_in_time(at, times)
    found[in_gap] = poses[nearest[in_gap]]
    far: Mask = in_gap & (np.abs(times - at[nearest]) > _margin(at))
    return far


def _is_beyond(times: Array, at: Array, margin: float) -> Mask:
    """Which of the times (S,) are more than a margin before the first or behind the last of `at` (P,), s."""
    beyond: Mask = (times < at[0] - margin) | (times > at[-1] + margin)
    return beyond


def _margin(at: Array) -> float:
    """The time from a pose during which it is used, s, if poses are at the times `at` (P,)."""
    return OdometryGapOptions.beyond * usual_period(at)


def _missing_notice(missing: Mask, times: Array, name: str) -> str:
    """The sentence that says at which scans (S,) odometry is missing; times (S,) in s."""
    gaps = shortened_list([_scans(first, end - 1) for first, end in mask_runs(missing)])
    seconds = float(np.gradient(times)[missing].sum()) if len(times) > 1 else 0.0
    return (
        f"odometry is missing at {counted(int(missing.sum()), 'scan')} ({seconds:.1f} s): no {name} near "
        f"{gaps}; the robot is assumed to keep its velocity there"
    )


def _scans(first: int, last: int) -> str:
    return f"scan {first}" if first == last else f"scans {first} to {last}"


def _in_gap(times: Array, at: Array, poses: Array) -> Mask:
    """(S,) which of the `times` (S,) lie in a gap between two poses (P, 3) at times (P,)."""
    periods = np.diff(at)
    steps = np.abs(relative(poses[1:], poses[:-1]))
    is_gap = periods > OdometryGapOptions.periods * usual_period(at)
    is_gap &= np.maximum(np.hypot(steps[:, 0], steps[:, 1]), steps[:, 2]) > OdometryGapOptions.motion
    after = np.searchsorted(at, times)
    found: Mask = (times > at[0]) & (times < at[-1]) & np.isin(after - 1, np.flatnonzero(is_gap))
    return found
