"""What tests of commands need."""

from __future__ import annotations

from pathlib import Path

import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from tests.data import OFFICE_LOG


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="session")
def office() -> LaserLog:
    """The office sample, with its true poses."""
    return read_log(OFFICE_LOG)
