"""MCAP recordings, of ROS 1, ROS 2 and Foxglove."""

from __future__ import annotations

from nscan_cli.files.inputs import FileBytes
from nscan_cli.logs.recordings.container import Recording
from nscan_cli.logs.recordings.mcap_records import read_records


def recording(data: FileBytes, file: str, salvage: bool) -> Recording:
    """All messages that are of use. Raises InputDataError and ExceededError."""
    return read_records(data, file, salvage)
