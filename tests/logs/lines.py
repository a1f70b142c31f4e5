"""CARMEN lines for tests, and how to read them."""

from __future__ import annotations

from pathlib import Path

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions


def flaser(
    time: float | str,
    ranges: tuple[float, ...] = (1.0, 2.0, 3.0),
    laser: tuple[float, float, float] = (0.0, 0.0, 0.0),
    robot: tuple[float, float, float] | None = None,
    tag: str = "FLASER",
) -> str:
    """A FLASER line; laser and robot are at one place unless `robot` is given."""
    stamp = time if isinstance(time, str) else f"{time:.6f}"
    values = " ".join(str(value) for value in (*ranges, *laser, *(robot or laser)))
    return f"{tag} {len(ranges)} {values} {stamp} nohost 0.1"


def read(folder: Path, *lines: str, options: ReadingOptions = ReadingOptions()) -> LaserLog:
    """The log that these lines make."""
    path = folder / "test.log"
    path.write_text("\n".join(lines) + "\n")
    return read_log(str(path), options)
