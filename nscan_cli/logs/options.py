"""What a user may say about how a log is to be read; the command line fills it in."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ReadingOptions:
    """What the user may say about how a log is to be read; None means: find it in the log."""

    laser: str | None = None
    mount: tuple[float, float, float] | None = None
    """x, y (m), θ (rad)."""
    flip: bool = False
    """The laser is mounted upside down: the beams run clockwise."""
    min_range: float | None = None
    max_range: float | None = None
    angle_min: float | None = None
    """rad"""
    angle_increment: float | None = None
    """rad"""
    start: float | None = None
    """Seconds after the first scan."""
    end: float | None = None
    every: int = 1
    odometry: bool = True
    strict: bool = False
    allow_corrected: bool = False
