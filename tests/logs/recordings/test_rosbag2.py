"""ROS 2 bags in SQLite: what may be missing in them, and what is no bag."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from nscan_cli.errors import InputDataError
from tests.logs.recordings.messages import check_drive, drive
from tests.logs.recordings.ros import db3


def changed(data: bytes, folder: Path, *statements: str) -> bytes:
    """A database after some SQL."""
    path = folder / "changed.db3"
    path.write_bytes(data)
    database = sqlite3.connect(path)
    for statement in statements:
        database.execute(statement)
    database.commit()
    database.close()
    return path.read_bytes()


def test_a_bag_from_before_ros_2_iron_has_no_definitions(read, tmp_path):
    old = changed(db3(drive(), tmp_path), tmp_path, "DROP TABLE message_definitions")
    check_drive(read(old))


def test_a_bag_that_was_written_with_a_write_ahead_log(read, tmp_path):
    data = changed(db3(drive(), tmp_path), tmp_path, "PRAGMA journal_mode=WAL")
    assert data[18:20] == b"\2\2"
    check_drive(read(data))


def test_a_database_that_is_no_bag(read, tmp_path):
    other = changed(b"", tmp_path, "CREATE TABLE songs (title)")
    with pytest.raises(InputDataError, match="is an SQLite database, but no ROS 2 bag"):
        read(other)


def test_a_database_that_is_cut_off(read, tmp_path):
    data = db3(drive(400), tmp_path)
    with pytest.raises(InputDataError, match="the database is damaged"):
        read(data[: len(data) // 2])
