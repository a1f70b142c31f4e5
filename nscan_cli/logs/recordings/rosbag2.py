"""ROS 2 bags in SQLite (.db3), without the metadata.yaml that goes with them."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Mapping
from contextlib import closing
from urllib.parse import quote

from nscan_cli.errors import InputDataError
from nscan_cli.files.limits import INPUT
from nscan_cli.logs.recordings.container import WANTED, Channel, Recording, ros_name
from nscan_cli.logs.recordings.sqlite_journal import merged

LEGACY_JOURNAL = b"\x01\x01"
JOURNAL = slice(18, 20)
"""Bytes of the header that ask for a write-ahead log, which does not exist in memory."""


def recording(data: bytes, file: str, salvage: bool) -> Recording:
    """All messages that are of use, in file order. Raises InputDataError and ExceededError."""
    with closing(sqlite3.connect(":memory:")) as bag:
        try:
            bag.deserialize(data[: JOURNAL.start] + LEGACY_JOURNAL + data[JOURNAL.stop :])
        except (sqlite3.Error, OverflowError) as error:
            raise _damaged(file, error) from error
        return _recording(bag, len(data), file, salvage)


def recording_at(path: str, beside: Mapping[str, str], file: str, salvage: bool) -> Recording:
    """The same of the database at a path, with what parts.beside has found beside it.

    Only what is wanted of it is taken into memory. Raises OutputError too, when there is no room for copies
    of several files that SQLite has to put together.
    """
    with merged(path, beside, file, salvage) as (place, warnings):
        # Nothing may be made or changed where the file is.
        address = f"file:{quote(os.path.abspath(place))}?mode=ro&immutable=1"
        with closing(sqlite3.connect(address, uri=True)) as bag:
            found = _recording(bag, min(os.path.getsize(place), INPUT.bytes), file, salvage)
    found.warnings[:0] = warnings
    return found


def _recording(bag: sqlite3.Connection, longest: int, file: str, salvage: bool) -> Recording:
    """What is in a database in which no value may be longer than `longest` bytes."""
    recording = Recording("ROS 2 bag (SQLite)")
    try:
        # A column may be made from a formula: its values need not be in the file.
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
        damaged = _damaged(file, error)
        if not salvage or not recording.messages:
            raise damaged from error
        recording.warnings.append(f"{_said(error)}: the messages before it are used")
    return recording


def _damaged(file: str, error: Exception) -> InputDataError:
    return InputDataError(file, _said(error), "fetch the file again")


def _said(error: Exception) -> str:
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
        channel = Channel(topic, ros_name(name), encoding, schema_encoding, text.encode())
        (count,) = next(bag.execute("SELECT count(*) FROM messages WHERE topic_id = ?", (number,)))
        recording.counts[channel] = recording.counts.get(channel, 0) + count
        if channel.type in WANTED:
            query = "SELECT timestamp, data FROM messages WHERE topic_id = ? ORDER BY id"
            for time, message in bag.execute(query, (number,)):
                recording.keep(channel, time, message)
