"""Headings from orientations that are no rotations about the vertical: what a driver wrote into them instead.

Drivers put the heading itself into z, or w first. The way that the robot drives tells which.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nscan_cli.files.limits import DISTANCE
from nscan_cli.logs.heading_unit import HeadingUnitOptions, along_way
from nscan_cli.logs.recordings.decoded_messages import Pose3D
from nscan_cli.logs.recordings.poses_3d import heading
from nscan_cli.poses import Array, wrap


@dataclass(frozen=True)
class OrientationOptions:
    """When orientations are no rotations about the vertical."""

    max_length_error: float = 0.05
    """Largest difference of a quaternion's length from 1. A larger value believes more orientations."""
    max_tilt: float = 0.5
    """Largest length of its x and y, as a share of the whole: at 0.5 the robot is tilted by 60°. A larger
    value believes more orientations."""
    min_odd_share: float = 0.1
    """Least share of such orientations. A larger value believes more recordings."""
    min_gain: float = 0.03
    """The mean cosine of twice the angle between the way and the heading is larger by so much if they are
    read otherwise: a heading of 90° in z, beside a w of 1, is a rotation by 115°. A larger value believes
    more recordings."""


def headings_of(poses: Sequence[Pose3D]) -> tuple[list[float | None], str]:
    """The headings (rad) of n poses, None where one is not valid, and what was put right; empty for nothing.

    They are read otherwise than as quaternions if many are no rotations about the vertical, and the robot
    drives along what else they may mean, but not along what they say.
    """
    way, options = HeadingUnitOptions(), OrientationOptions()
    said = [heading(pose) for pose in poses]
    known: Array = np.array([np.nan if angle is None else angle for angle in said], dtype=np.float64)
    rotations = np.array([pose.rotation for pose in poses], dtype=np.float64).reshape(-1, 4)
    lengths = np.sqrt((rotations**2).sum(axis=1))
    is_odd = np.abs(lengths - 1.0) > options.max_length_error
    is_odd |= np.hypot(rotations[:, 0], rotations[:, 1]) > options.max_tilt * lengths
    if not len(poses) or is_odd.mean() < options.min_odd_share:
        return said, ""
    x, _, z, w = rotations.T
    others = {
        "z is the heading in radians": z,
        "z is the heading in degrees": np.radians(z),
        "w comes first": 2.0 * np.arctan2(w, x),
    }
    positions = np.array([pose.translation[:2] for pose in poses], dtype=np.float64)
    told = np.isfinite(known)
    fits = along_way(positions[told], [angles[told] for angles in (known, *others.values())], way)
    if fits is None:
        return said, ""
    best = int(np.argmax(fits[1:]))
    if fits[1 + best] < max(way.min_along, fits[0] + options.min_gain):
        return said, ""
    name, angles = list(others.items())[best]
    # A heading near 0 may be a quaternion near 0.
    is_pose = told | ((lengths < 1.0) & (np.abs(positions) < DISTANCE.value).all(axis=1))
    found = [float(angle) if is_one else None for angle, is_one in zip(wrap(angles), is_pose, strict=True)]
    return found, f"orientations are no rotations, but {name}, along which the robot drives: it is used"
