"""MCAP recordings, of ROS 1, ROS 2 and Foxglove."""

from __future__ import annotations

from nscan_cli.logs import recorded
from nscan_cli.logs.mcap_records import read_records
from nscan_cli.logs.options import ReadingOptions
from nscan_cli.logs.scan import LaserLog, Source


def read(data: bytes, file: str, source: Source, options: ReadingOptions) -> LaserLog:
    """The scans of one topic; raises InputDataError and WrongUsageError as recorded.read does."""
    return recorded.read(read_records(data, file, options.salvage), file, source, options)
