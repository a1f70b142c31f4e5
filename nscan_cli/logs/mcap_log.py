"""MCAP recordings, of ROS 1, ROS 2 and Foxglove."""

from __future__ import annotations

from nscan_cli.inputs import Bytes
from nscan_cli.logs.mcap_records import read_records
from nscan_cli.logs.recording import Recording


def recording(data: Bytes, file: str, salvage: bool) -> Recording:
    """All messages that are of use. Raises InputDataError and ExceededError."""
    return read_records(data, file, salvage)
