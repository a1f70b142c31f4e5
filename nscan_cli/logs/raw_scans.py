"""The scans of one laser as they are in a log: what every reader makes first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.limits import READINGS
from nscan_cli.logs.sweep import RecordedSweep
from nscan_cli.poses import Array


@dataclass(frozen=True)
class RawScans:
    """The scans of one laser as in the log, in file order: S scans of at most B beams."""

    ranges: NDArray[np.float32]
    """(S, B) readings as written, m; nan for beams that a scan does not have."""
    angle_min: Array
    """(S,) direction of the first beam, rad."""
    angle_increment: Array
    """(S,) angle from beam to beam, rad."""
    stamps: list[str]
    """S time stamps as written."""
    limits: tuple[float | Array, float | Array]
    """Lower and upper limit of all scans, or (S,) of each, m. Readings at or beyond a limit are unusable."""
    limits_from: tuple[str, str] = ("none in this form of log", "assumed for this form of log")
    """Origin of each limit."""
    doubtful: Sequence[tuple[float, str]] = ()
    """Upper limits (m) that may not be the laser's own, and their origin."""
    angle_max: Array | None = None
    """(S,) direction of the last beam as written beside the step, rad; nan if a scan has none."""
    beams: NDArray[np.int64] | None = None
    """(S,) number of beams of each scan; None if all have B."""
    recorded_sweep: RecordedSweep | None = None
    """The times of the beams as written; None if the log has none."""
    angles_assumed: bool = False
    """Whether the directions are a convention of the form of log, and not written in it."""

    def mirrored(self) -> RawScans:
        """The scans with all directions negated."""
        last = None if self.angle_max is None else -self.angle_max
        return replace(self, angle_min=-self.angle_min, angle_increment=-self.angle_increment, angle_max=last)


def empty_scan_table(scans: int, beams: int) -> NDArray[np.float32]:
    """A table of readings (S, B), all nan. Raises LimitExceededError if it is too large."""
    problem = f"has {scans:,} scans of up to {beams:,} beams, {scans * beams:,} readings"
    READINGS.check(scans * beams, problem)
    return np.full((scans, beams), np.nan, dtype=np.float32)


def scan_table(readings: Sequence[NDArray[Any]]) -> NDArray[np.float32]:
    """Scans of different lengths as rows (S, B), filled up with nan. Raises LimitExceededError."""
    rows = empty_scan_table(len(readings), max(map(len, readings), default=0))
    with np.errstate(over="ignore", invalid="ignore"):
        for row, values in zip(rows, readings, strict=True):
            row[: len(values)] = values
    return rows
