"""The real logs that some tests read; they are no part of the repository."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

BESIDE_THE_REPOSITORY = Path(__file__).resolve().parents[2] / "shared" / "data"


def find_data(name: str) -> Path | None:
    """The real log or graph `name` in the folder NSCAN_DATA; None where it is absent."""
    path = Path(os.environ.get("NSCAN_DATA", BESIDE_THE_REPOSITORY)) / name
    return path if path.is_file() else None


def data_file(name: str) -> Path:
    """The real log or graph `name`, as find_data; the test is skipped where it is absent."""
    path = find_data(name)
    if path is None:
        pytest.skip(f"{name} is not there: set NSCAN_DATA to the folder of the real logs")
    return path
