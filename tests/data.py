"""Logs that tests read: the samples of the repository, and real logs that are no part of it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[1]
SAMPLE_LOGS = REPOSITORY / "sample_logs"
PACKAGE = REPOSITORY / "nscan_cli"
OFFICE_LOG = str(SAMPLE_LOGS / "office.log.gz")
CORRIDOR_LOG = str(SAMPLE_LOGS / "corridor_and_room.log.gz")
TURNING_LOG = str(SAMPLE_LOGS / "turning_laser.mcap")
REAL_LOGS = REPOSITORY.parent / "shared" / "data"
"""The folder of the real logs unless NSCAN_DATA names another."""


def find_data(name: str) -> Path | None:
    """The real log (a file or a folder) or graph `name` in the folder NSCAN_DATA; None where it is absent."""
    path = Path(os.environ.get("NSCAN_DATA", REAL_LOGS)) / name
    return path if path.exists() else None


def data_file(name: str) -> Path:
    """The real log or graph `name`, as find_data; the test is skipped where it is absent."""
    path = find_data(name)
    if path is None:
        pytest.skip(f"{name} is not there: set NSCAN_DATA to the folder of the real logs")
    return path
