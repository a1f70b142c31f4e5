"""Poses of the robot at the times of the scans, from poses at other times."""

from __future__ import annotations

import numpy as np

from nscan_cli.files.counting import counted
from nscan_cli.poses import Array, wrap


def interpolated_poses(times: Array, at: Array, poses: Array, name: str, warnings: list[str]) -> Array | None:
    """Poses (S, 3) at `times` (S,) from `poses` (P, 3) at the times `at` (P,), sorted.

    Linear in x, y and the unwrapped angle; before the first and after the last pose these hold. None,
    with a warning, when no scan lies between them. `name` is what the warnings call the poses.
    """
    outside = int(np.sum((times < at[0]) | (times > at[-1])))
    if outside == len(times):
        warnings.append(
            f"no scan lies between the first {name} and the last: these are from {at[0]:.3f} s to "
            f"{at[-1]:.3f} s, the scans from {times[0]:.3f} s to {times[-1]:.3f} s: no odometry"
        )
        return None
    if outside:
        warnings.append(
            f"{counted(outside, 'scan')} before the first {name} or after the last, which is taken for them"
        )
    angles = np.unwrap(poses[:, 2])
    columns = (poses[:, 0], poses[:, 1], angles)
    found = np.stack([np.interp(times, at, column) for column in columns], axis=-1)
    found[:, 2] = wrap(found[:, 2])
    return found
