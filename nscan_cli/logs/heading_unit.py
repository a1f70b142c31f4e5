"""The unit of headings: degrees in place of radians, told by the way that the robot drives along them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nscan_cli.poses import Array, are_known, path_lengths


@dataclass(frozen=True)
class HeadingUnitOptions:
    """When headings are in degrees."""

    max_radians: float = 2 * np.pi + 0.01
    """Largest size of headings that may not be degrees, rad, with what their log has rounded. A larger value
    converts fewer logs."""
    min_step: float = 0.05
    """Least length of a step whose direction counts, m. A larger value lets fewer steps tell."""
    min_steps: int = 10
    """Least number of such steps. A larger value converts fewer logs."""
    min_along: float = 0.9
    """Least mean cosine of twice the angle between such steps and the headings in degrees. It is 0.989 or
    more on all logs in their own unit, and 0.33 at most in the other one. A larger value converts fewer
    logs."""
    min_gain: float = 0.3
    """Least difference of this mean from that with the headings in radians: a straight drive tells little. A
    larger value converts fewer logs."""


def are_in_degrees(poses: Array, options: HeadingUnitOptions = HeadingUnitOptions()) -> bool:
    """Whether the headings of poses (P, 3), in order of time and as written, are in degrees.

    Headings within 2π, and those of a robot that does not move, are taken as rad.
    """
    poses = poses[are_known(poses)]
    if len(poses) < 2 or np.abs(poses[:, 2]).max() <= options.max_radians:
        return False
    fits = along_way(poses[:, :2], [np.radians(poses[:, 2]), poses[:, 2]], options)
    return fits is not None and fits[0] >= max(options.min_along, fits[1] + options.min_gain)


def along_way(positions: Array, headings: Sequence[Array], options: HeadingUnitOptions) -> list[float] | None:
    """How well a robot at positions (P, 2) drives along each of several headings (P,), rad, in order of time.

    It is the mean cosine of twice the angle between both, because the robot may drive backwards. None for
    few steps.
    """
    pieces = np.floor(path_lengths(positions) / options.min_step)
    ends = np.append(0, np.flatnonzero(np.diff(pieces) > 0.0) + 1)
    if len(ends) <= options.min_steps:
        return None
    x, y = np.diff(positions[ends], axis=0).T
    directions = np.arctan2(y, x)

    def along(angles: Array) -> float:
        # Half-way between both ends of a step.
        turned = np.unwrap(angles)
        middle = 0.5 * (turned[ends[1:]] + turned[ends[:-1]])
        return float(np.cos(2 * (directions - middle)).mean())

    return [along(angles) for angles in headings]
