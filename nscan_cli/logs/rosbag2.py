"""ROS 2 bags in SQLite (.db3), without the metadata.yaml that goes with them."""

from __future__ import annotations

import sqlite3
from contextlib import closing

from nscan_cli.errors import InputDataError
from nscan_cli.logs.recording import WANTED, Channel, Recording, ros_name

LEGACY_JOURNAL = b"\x01\x01"
JOURNAL = slice(18, 20)
"""Bytes of the header that ask for a write-ahead log, which does not exist in memory."""


def recording(data: bytes, file: str, salvage: bool) -> Recording:
    """All messages that are of use, in file order. Raises InputDataError."""
    recording = Recording("ROS 2 bag (SQLite)")
    try:
        with closing(sqlite3.connect(":memory:")) as bag:
            # A column may be made from a formula: its values need not be in the file.
            bag.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, len(data))
            bag.deserialize(data[: JOURNAL.start] + LEGACY_JOURNAL + data[JOURNAL.stop :])
            tables = {name for (name,) in bag.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
            if not {"topics", "messages"} <= tables:
                remedy = "give the .db3 file of a ROS 2 bag"
                raise InputDataError(file, "is an SQLite database, but no ROS 2 bag", remedy)
            problem = next(bag.execute("PRAGMA integrity_check"))[0]
            if problem != "ok":
                raise sqlite3.DatabaseError(str(problem))
            _read_tables(bag, "message_definitions" in tables, recording)
    except (sqlite3.Error, OverflowError, UnicodeDecodeError, TypeError) as error:
        problem = f"the database is damaged ({' '.join(str(error).split())})"
        if not salvage or not recording.messages:
            raise InputDataError(file, problem, "fetch the file again") from error
        recording.warnings.append(f"{problem}: the messages before it are used")
    return recording


def _read_tables(bag: sqlite3.Connection, with_schemas: bool, recording: Recording) -> None:
    schemas: dict[str, tuple[str, str]] = {}
    if with_schemas:
        query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        schemas = {name: (encoding, text) for name, encoding, text in bag.execute(query)}
    for number, topic, name, encoding in bag.execute(
        "SELECT id, name, type, serialization_format FROM topics"
    ):
        schema_encoding, text = schemas.get(name, ("", ""))
        channel = Channel(topic, ros_name(name), encoding, schema_encoding, text.encode())
        (count,) = next(bag.execute("SELECT count(*) FROM messages WHERE topic_id = ?", (number,)))
        recording.counts[channel] = recording.counts.get(channel, 0) + count
        if channel.type in WANTED:
            query = "SELECT timestamp, data FROM messages WHERE topic_id = ? ORDER BY id"
            for time, message in bag.execute(query, (number,)):
                recording.keep(channel, time, message)
