"""Small logs made by hand."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from nscan_cli.files.provenance import Source
from nscan_cli.logs.laser_log import LaserLog, LogReport


def log_of(
    ranges: ArrayLike, angle_min: float, angle_increment: float, mount: ArrayLike = (0, 0, 0)
) -> LaserLog:
    """A log of scans (S, B) of one laser."""
    table = np.asarray(ranges, dtype=np.float32)
    scans = len(table)
    return LaserLog(
        source=Source("made.log", "0" * 64, 1),
        format="CARMEN",
        laser="FLASER",
        numbers=np.arange(scans),
        stamps=tuple(f"{k}.0" for k in range(scans)),
        times=np.arange(scans, dtype=np.float64),
        ranges=table,
        angle_min=np.full(scans, angle_min),
        angle_increment=np.full(scans, angle_increment),
        mount=np.asarray(mount, dtype=np.float64),
        odometry=None,
        no_return=None,
        range_limits=(0.0, 80.0),
        report=LogReport(),
    )


def half_circle(distances: ArrayLike) -> LaserLog:
    """Scans (S, 181) from −90° to 90°, a degree apart."""
    return log_of(distances, -np.pi / 2, np.pi / 180)
