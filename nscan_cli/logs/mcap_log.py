"""MCAP recordings, of ROS 1, ROS 2 and Foxglove."""

from __future__ import annotations

from nscan_cli.logs import recorded
from nscan_cli.logs.mcap_records import read_records
from nscan_cli.logs.options import ReadingOptions
from nscan_cli.logs.recording import Recording
from nscan_cli.logs.scan import LaserLog, Source


def recording(data: bytes, file: str, salvage: bool) -> Recording:
    """All messages that are of use. Raises InputDataError and ExceededError."""
    return read_records(data, file, salvage)


def read(data: bytes, file: str, source: Source, options: ReadingOptions) -> LaserLog:
    """The scans of one topic; raises InputDataError and WrongUsageError as recorded.read does."""
    return recorded.read(recording(data, file, options.salvage), file, source, options)
