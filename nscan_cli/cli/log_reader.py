"""One log read several times with different options."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from nscan_cli.logs.reading_options import ReadingOptions

if TYPE_CHECKING:
    from nscan_cli.logs.laser_log import LaserLog

ReadLog = Callable[[ReadingOptions], "LaserLog"]


def log_reader(paths: Sequence[str], even_unusable: bool = False) -> ReadLog:
    """A function that reads the log at `paths` with other options; standard input is read only once.

    The function raises what read_log raises.
    """
    from nscan_cli.files.inputs import STANDARD_INPUT, read_bytes
    from nscan_cli.logs.load import log_from, read_log

    if tuple(paths) != (STANDARD_INPUT,):
        return lambda options: read_log(paths, options, even_unusable)
    stored = read_bytes(STANDARD_INPUT)
    return lambda options: log_from(stored, STANDARD_INPUT, options, even_unusable)
