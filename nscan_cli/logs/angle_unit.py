"""The unit of the beams' angles: degrees in place of radians, where the beams would cover many turns."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.logs.laser_log import beam_counts
from nscan_cli.logs.raw_scans import RawScans
from nscan_cli.poses import Array

ANGLES_CONVERTED = (
    "the angles of the beams are in degrees, for as radians they would be many turns: they are converted to "
    "radians; --as-recorded takes them as radians"
)


@dataclass(frozen=True)
class AngleUnitOptions:
    """When angles are in degrees."""

    max_direction: float = 4 * np.pi
    """Largest first direction that may be in radians, rad. A larger value converts fewer logs."""
    max_view: float = 8 * np.pi
    """Largest angle from the first to the last beam that may be in radians, rad: far above that of steps
    that are a few times too large. A larger value converts fewer logs."""


def with_radians(raw: RawScans, options: AngleUnitOptions = AngleUnitOptions()) -> tuple[RawScans, list[str]]:
    """The scans with all angles in radians, and the messages for the user.

    Directions and steps are told apart: some drivers convert one of them.
    """
    last = raw.angle_min if raw.angle_max is None else raw.angle_max
    view = raw.angle_increment * (beam_counts(raw.ranges, raw.beams) - 1)
    spread = _usual(view) > options.max_view
    # A step that is some times too large alone makes a last direction too large.
    turned = max(_usual(raw.angle_min), spread * _usual(last)) > options.max_direction
    if turned:
        raw = replace(
            raw,
            angle_min=np.radians(raw.angle_min),
            angle_max=None if raw.angle_max is None else np.radians(raw.angle_max),
        )
    if spread:
        raw = replace(raw, angle_increment=np.radians(raw.angle_increment))
    return raw, [ANGLES_CONVERTED] if turned or spread else []


def _usual(angles: Array) -> float:
    """The median size of angles (S,), rad; nan are left out."""
    known = angles[np.isfinite(angles)]
    return float(np.median(np.abs(known))) if len(known) else 0.0
