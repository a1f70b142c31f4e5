"""The options for reading a log, set on the command line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from nscan_cli.errors import WrongUsageError

STAMPS = ("first", "middle", "last")
"""The beams at whose time a scan may be stamped."""
SECTOR_PARTS = 2
"""Bearings of a sector of a mask; a range may follow."""
LONGEST_TURN = 2.0
"""s; no laser that maps turns more slowly."""


@dataclass(frozen=True)
class ReadingOptions:
    """The options for reading a log. None means that the value is taken from the log."""

    laser: str | None = None
    """Tag or device of the laser in a text log."""
    topic: str | None = None
    """Topic of the laser in a recording."""
    odom_topic: str | None = None
    """Topic of the odometry, a frame whose pose in odom tf gives, or a device of a Player log."""
    mount: tuple[float, float, float] | None = None
    """Pose of the laser on the robot: x, y (m), θ (rad)."""
    flip: bool = False
    """The laser is mounted upside down: the beams run clockwise."""
    min_range: float | None = None
    """Lower range limit, m. A larger value drops more near readings."""
    max_range: float | None = None
    """Upper range limit, m. Readings from there on are read as no return."""
    range_scale: float | None = None
    """Metres in a unit of the log's ranges. Range limits in the same unit are scaled too."""
    range_offset: float | None = None
    """Length to add to all ranges, m."""
    angle_min: float | None = None
    """Direction of the first beam, rad."""
    angle_increment: float | None = None
    """Angle from beam to beam, rad."""
    mask: tuple[tuple[float, ...], ...] | None = None
    """Sectors of beams that are not read: two bearings in the laser's frame each, from the first
    counter-clockwise to the second, rad. With a range behind them, m, only nearer readings are not read."""
    sweep: float | None = None
    """Time that a sweep of the laser takes, s: beams are seen one after another. Negative if the
    readings are in the reverse order of time; 0: all are seen at once."""
    stamp: str = "first"
    """Beam at whose time a scan is stamped: first, middle or last of the scan."""
    start: float | None = None
    """Time of the first scan to read after the log's first one, s."""
    end: float | None = None
    """Time of the last scan to read after the log's first one, s."""
    every: int = 1
    """Only every n-th of these scans is read."""
    odometry: bool = True
    """Whether odometry is read."""
    odometry_scale: float = 1.0
    """Factor of the positions by odometry: 0.001 for positions in millimetres."""
    clock_offset: float = 0.0
    """Time to add to the stamps of the odometry, s, so that they are in the clock of the scans."""
    strict: bool = False
    """Whether a malformed record is an error. Otherwise it is skipped."""
    allow_corrected: bool = False
    """Whether poses that a mapper has corrected may be read as odometry."""
    salvage: bool = False
    """Whether the readable part of a damaged or truncated file is used."""
    as_recorded: bool = False
    """Whether the log is believed where its scans contradict it. Otherwise what is beyond doubt is put
    right."""

    def __post_init__(self) -> None:
        """Raises WrongUsageError for values that fit no log."""
        given = (self.min_range, self.max_range, self.range_scale, self.range_offset, self.angle_min,
                 self.angle_increment, self.start, self.end, self.odometry_scale, self.clock_offset,
                 self.sweep)  # fmt: skip
        if not all(math.isfinite(value) for value in (*given, *(self.mount or ())) if value is not None):
            raise WrongUsageError("a reading option is not a finite number; give one that is")
        if self.max_range is not None and self.max_range <= (self.min_range or 0.0):
            raise WrongUsageError("--max-range leaves no beam; it has to be above 0 and --min-range")
        if self.range_scale is not None and self.range_scale <= 0:
            raise WrongUsageError("--range-scale has to be above 0")
        if self.angle_increment == 0:
            raise WrongUsageError("--angle-increment is 0; beams need different directions")
        if self.sweep is not None and abs(self.sweep) > LONGEST_TURN:
            raise WrongUsageError(f"--sweep is beyond {LONGEST_TURN:g} s; give the seconds of one turn")
        if self.stamp not in STAMPS:
            raise WrongUsageError(f"--stamp is {self.stamp!r}; give one of {', '.join(STAMPS)}")
        if self.odometry_scale == 0:
            raise WrongUsageError("--odometry-scale is 0; give the metres of one unit of odometry")
        for sector in self.mask or ():
            if not all(math.isfinite(part) for part in sector):
                raise WrongUsageError("--mask has a bearing or a range that is not a finite number")
            if len(sector) > SECTOR_PARTS and sector[SECTOR_PARTS] <= 0:
                raise WrongUsageError("--mask leaves out no reading nearer than 0; give a range above that")
        if self.start is not None and self.end is not None and self.start > self.end:
            raise WrongUsageError("--start is after --end; no scan lies between")

    def refuse_topics(self, file: str, form: str, instead: str, of_odometry: bool = True) -> None:
        """Raises WrongUsageError if a topic, also one `of_odometry`, is given for a log of `form`."""
        odometry = self.odom_topic if of_odometry else None
        for option, value in (("--topic", self.topic), ("--odom-topic", odometry)):
            if value is not None:
                raise WrongUsageError(f"{file}: is {form}, without topics; leave out {option}, see {instead}")


def sectors_from(text: str) -> tuple[tuple[float, ...], ...]:
    """The sectors of a text as --mask takes it: FROM:TO,… in degrees, or FROM:TO@M with a range in m.

    Raises ValueError if it is none.
    """
    sectors = []
    for part in text.split(","):
        bearings, at, distance = part.partition("@")
        first, last = (math.radians(float(bearing)) for bearing in bearings.split(":"))
        sector = (first, last, float(distance)) if at else (first, last)
        if not math.isfinite(sum(sector)) or (at and sector[-1] <= 0.0):
            raise ValueError(f"{part} has no bearings, or no range above 0")
        sectors.append(sector)
    return tuple(sectors)


def sector_text(sector: tuple[float, ...], decimals: tuple[int, int] = (12, 12)) -> str:
    """A sector (rad, and m) as --mask takes it, with so many decimals of degrees and of metres."""
    first, last, *nearer = sector
    bearings = ":".join(f"{round(math.degrees(bearing), decimals[0]):.12g}" for bearing in (first, last))
    return "@".join([bearings, *(f"{round(distance, decimals[1]):.12g}" for distance in nearer)])


def as_tuples(value: Any) -> Any:
    """The value of an option from a document, with tuples in place of lists."""
    return tuple(as_tuples(part) for part in value) if isinstance(value, list) else value
