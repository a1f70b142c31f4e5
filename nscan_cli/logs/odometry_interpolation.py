"""Poses of the robot at the times of the scans, from poses at other times."""

from __future__ import annotations

import numpy as np

from nscan_cli.files.text import counted
from nscan_cli.poses import Array, wrap


def interpolated_poses(times: Array, at: Array, poses: Array, name: str, warnings: list[str]) -> Array | None:
    """Poses (S, 3) at `times` (S,), interpolated between `poses` (P, 3) at the sorted times `at` (P,).

    Linear in x, y and the unwrapped angle. Before the first and after the last pose, that pose is used.
    Returns None, with a warning, if no scan lies between them. `name` is what warnings call a pose.
    """
    outside = int(np.sum((times < at[0]) | (times > at[-1])))
    if outside == len(times):
        warnings.append(
            f"no scan lies between the first {name} ({at[0]:.3f} s) and the last ({at[-1]:.3f} s): the scans "
            f"go from {times[0]:.3f} s to {times[-1]:.3f} s; no odometry"
        )
        return None
    if outside:
        warnings.append(
            f"{counted(outside, 'scan')} before the first {name} or after the last: that one's pose is used"
        )
    angles = np.unwrap(poses[:, 2])
    columns = (poses[:, 0], poses[:, 1], angles)
    found = np.stack([np.interp(times, at, column) for column in columns], axis=-1)
    found[:, 2] = wrap(found[:, 2])
    return found
