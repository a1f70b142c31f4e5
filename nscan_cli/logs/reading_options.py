"""What a user may say about how a log is to be read; the command line fills it in."""

from __future__ import annotations

import math
from dataclasses import dataclass

from nscan_cli.errors import WrongUsageError


@dataclass(frozen=True)
class ReadingOptions:
    """What the user may say about how a log is to be read; None means: find it in the log."""

    laser: str | None = None
    """Tag or device of the laser in a text log."""
    topic: str | None = None
    """Topic of the laser in a recording."""
    odom_topic: str | None = None
    """Topic of the odometry, a frame that tf places in odom, or a device of a Player log."""
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
    salvage: bool = False
    """Use what is readable of a damaged or truncated file."""

    def __post_init__(self) -> None:
        """Refuse values that no log fits. Raises WrongUsageError."""
        given = (self.min_range, self.max_range, self.angle_min, self.angle_increment, self.start, self.end)
        if not all(math.isfinite(value) for value in (*given, *(self.mount or ())) if value is not None):
            raise WrongUsageError("a reading option is not a finite number; give one that is")
        if self.max_range is not None and self.max_range <= (self.min_range or 0.0):
            raise WrongUsageError("--max-range leaves no beam; it has to be above 0 and --min-range")
        if self.angle_increment == 0:
            raise WrongUsageError("--angle-increment is 0; beams need different directions")
        if self.start is not None and self.end is not None and self.start > self.end:
            raise WrongUsageError("--start is after --end; no scan lies between")

    def refuse_topic(self, file: str, form: str, instead: str) -> None:
        """For a log of `form` whose lasers are no topics. Raises WrongUsageError when one is asked for."""
        self._refuse("--topic", self.topic, file, form, instead)

    def refuse_topics(self, file: str, form: str, instead: str) -> None:
        """For a log of `form` without topics at all. Raises WrongUsageError when one is asked for."""
        self.refuse_topic(file, form, instead)
        self._refuse("--odom-topic", self.odom_topic, file, form, instead)

    def _refuse(self, option: str, value: str | None, file: str, form: str, instead: str) -> None:
        if value is not None:
            raise WrongUsageError(f"{file}: is {form}, without topics; leave out {option}, see {instead}")
