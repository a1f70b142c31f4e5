"""ROS 2 bags in SQLite (.db3): one file of a bag.

A bag's folder and its metadata.yaml are read in logs/log_files.py. A file alone is read without them.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Mapping
from contextlib import closing
from urllib.parse import quote

from nscan_cli.errors import InputDataError
from nscan_cli.files.limits import INPUT
from nscan_cli.logs.recordings.container import Channel, Recording
from nscan_cli.logs.recordings.message_types import READ_TYPES, ros2_type_name
from nscan_cli.logs.recordings.sqlite_journal import recovered_database

JOURNAL_MODE = slice(18, 20)
"""Bytes of the header that can ask for a write-ahead log, which a database in memory cannot have."""
ROLLBACK_JOURNAL = b"\x01\x01"
FETCH_AGAIN = "fetch the file again"


def read_recording(data: bytes, file: str, salvage: bool) -> Recording:
    """The messages of a bag in memory, in file order. Raises InputDataError and LimitExceededError."""
    with closing(sqlite3.connect(":memory:")) as bag:
        try:
            bag.deserialize(data[: JOURNAL_MODE.start] + ROLLBACK_JOURNAL + data[JOURNAL_MODE.stop :])
        except (sqlite3.Error, OverflowError) as error:
            raise InputDataError(file, _damage(error), FETCH_AGAIN) from error
        return _read_bag(bag, len(data), file, salvage)


def read_recording_file(path: str, beside: Mapping[str, str], file: str, salvage: bool) -> Recording:
    """The messages of the bag at a path, with its journals `beside` it (suffix → path), in file order.

    Only messages that are read are taken into memory. Raises InputDataError and LimitExceededError, and
    OutputError when there is no room for copies of the bag and its journals.
    """
    with recovered_database(path, beside, file, salvage) as (place, warnings):
        # Immutable: SQLite neither changes the file nor creates others beside it.
        address = f"file:{quote(os.path.abspath(place))}?mode=ro&immutable=1"
        with closing(sqlite3.connect(address, uri=True)) as bag:
            found = _read_bag(bag, min(os.path.getsize(place), INPUT.bytes), file, salvage)
    found.warnings[:0] = warnings
    return found


def _read_bag(bag: sqlite3.Connection, longest: int, file: str, salvage: bool) -> Recording:
    """The messages of a database in which no value may be longer than `longest` bytes."""
    recording = Recording("ROS 2 bag (SQLite)")
    try:
        # A generated column can produce values that are much larger than the file.
        bag.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, longest)
        tables = {name for (name,) in bag.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if not {"topics", "messages"} <= tables:
            remedy = "give the .db3 file of a ROS 2 bag"
            raise InputDataError(file, "is an SQLite database, but no ROS 2 bag", remedy)
        problem = next(bag.execute("PRAGMA integrity_check"))[0]
        if problem != "ok":
            raise sqlite3.DatabaseError(str(problem))
        _read_tables(bag, "message_definitions" in tables, recording)
    except (sqlite3.Error, OverflowError, UnicodeDecodeError, TypeError) as error:
        if not salvage or not recording.messages:
            raise InputDataError(file, _damage(error), FETCH_AGAIN) from error
        recording.warnings.append(f"{_damage(error)}: the messages before it are used")
    return recording


def _damage(error: Exception) -> str:
    return f"the database is damaged ({' '.join(str(error).split())})"


def _read_tables(bag: sqlite3.Connection, with_schemas: bool, recording: Recording) -> None:
    schemas: dict[str, tuple[str, str]] = {}
    if with_schemas:
        query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        schemas = {name: (encoding, text) for name, encoding, text in bag.execute(query)}
    for number, topic, name, encoding in bag.execute(
        "SELECT id, name, type, serialization_format FROM topics"
    ):
        schema_encoding, text = schemas.get(name, ("", ""))
        channel = Channel(topic, ros2_type_name(name), encoding, schema_encoding, text.encode())
        (count,) = next(bag.execute("SELECT count(*) FROM messages WHERE topic_id = ?", (number,)))
        recording.counts[channel] = recording.counts.get(channel, 0) + count
        if channel.type in READ_TYPES:
            query = "SELECT timestamp, data FROM messages WHERE topic_id = ? ORDER BY id"
            for time, message in bag.execute(query, (number,)):
                recording.add(channel, time, message)
