"""Bags: what may be missing in them, how they may be packed, and what is no bag."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from nscan_cli.errors import InputDataError
from tests.logs import ros_text
from tests.logs.recordings import drive
from tests.logs.ros_recordings import bag1, db3, ros_message, ros_type
from tests.logs.test_recorded import check_drive


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


@pytest.mark.parametrize("compression", ["BZ2", "LZ4"])
def test_packed_bags(read, tmp_path, compression):
    from rosbags.rosbag1 import Writer

    store = ros_text.store(ros1=True)
    path = tmp_path / "packed.bag"
    writer = Writer(path)
    writer.set_compression(Writer.CompressionFormat[compression])
    with writer:
        connections = {}
        for one in drive():
            name = ros_type(one.content)
            if one.topic not in connections:
                connections[one.topic] = writer.add_connection(one.topic, name, typestore=store)
            message = ros_text.as_message(store, name, ros_message(one.content, with_seq=True))
            writer.write(connections[one.topic], one.log_time, store.serialize_ros1(message, name))
    check_drive(read(path.read_bytes()))


def test_a_bag_without_index(read, tmp_path):
    data = bag1(drive(), tmp_path)
    at = data.index(b"index_pos=") + len(b"index_pos=")
    with pytest.raises(InputDataError, match=r"not indexed.*`rosbag reindex`"):
        read(data[:at] + bytes(8) + data[at + 8 :])


def test_a_damaged_chunk_of_a_bag(read, tmp_path):
    data = bag1(drive(), tmp_path)
    # The first record of the chunk that holds the 5th scan: its header gets another field's name.
    at = data.rindex(b"op=\2", 0, data.rindex(b"laser"))
    at = data.rindex(b"op=", 0, at)
    broken = data[:at] + b"xx=" + data[at + 3 :]
    with pytest.raises(InputDataError, match="damaged or cut off"):
        read(broken)
    log = read(broken, salvage=True)
    assert 0 < len(log) < 12
    assert "what is whole is used" in log.report.warnings[0]
