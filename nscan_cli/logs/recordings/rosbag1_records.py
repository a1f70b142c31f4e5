"""The records that ROS 1 bags (format 2.0) consist of.

Source of the form: wiki.ros.org/Bags/Format/2.0. A record is a header of named fields, and data; each begins
with its length.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import NamedTuple

from nscan_cli.files.inputs import FileBytes

LENGTH, LONG, TIME = struct.Struct("<I"), struct.Struct("<Q"), struct.Struct("<II")
MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, HEADER, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7
KINDS = range(MESSAGE, CONNECTION + 1)
ENTRY = {INDEX: 12, CHUNK_INFO: 8}
"""Bytes of each entry in the records that make up the index."""
CHUNK_FIELD = b"\x04\x00\x00\x00op=\x05"
"""A field of the header of each chunk."""
LONGEST_CHUNK_HEADER = 200
"""Bytes."""


class DamagedBagError(Exception):
    """The records cannot be followed beyond a byte."""

    def __init__(self, at: int, problem: str, in_index: bool = False) -> None:
        super().__init__(problem)
        self.at, self.in_index = at, in_index
        """Whether it is a record of the index that is broken, and no message with it."""


class BagRecord(NamedTuple):
    """One record of some bytes: what it is, its fields, and where its data begin and end."""

    at: int
    kind: int
    fields: dict[bytes, bytes]
    begin: int
    end: int

    def number(self, name: bytes, form: struct.Struct = LENGTH) -> int:
        """A field that is a number. Raises BrokenError when it is none."""
        return int(form.unpack(self._field(name, form.size))[0])

    def time(self) -> int:
        """The field with the time of a message, ns."""
        seconds, nanoseconds = TIME.unpack(self._field(b"time", TIME.size))
        return int(seconds) * 10**9 + int(nanoseconds)

    def text(self, name: bytes) -> str:
        """A field that is a text. Raises BrokenError when it is not there."""
        if name not in self.fields:
            raise DamagedBagError(self.at, f"a record without {name.decode()}")
        return self.fields[name].decode("utf-8", "replace")

    def _field(self, name: bytes, size: int) -> bytes:
        value = self.fields.get(name, b"")
        if len(value) != size:
            raise DamagedBagError(self.at, f"a record without {name.decode()}")
        return value


def record_at(data: FileBytes, at: int, end: int) -> BagRecord:
    """The record that begins at a byte, and ends before `end`. Raises BrokenError when there is none."""
    fields, begin = fields_at(data, at, end, "a record's header")
    if begin + LENGTH.size > end:
        raise DamagedBagError(at, "it ends within a record")
    (size,) = LENGTH.unpack_from(data, begin)
    begin += LENGTH.size
    kind = fields.get(b"op", b"")
    if len(kind) != 1 or kind[0] not in KINDS:
        raise DamagedBagError(at, "a record of no known kind")
    if begin + size > end:
        raise DamagedBagError(at, "it ends within a record", kind[0] in ENTRY)
    return BagRecord(at, kind[0], fields, begin, begin + size)


def records(data: FileBytes, start: int, end: int) -> Iterator[BagRecord]:
    """One record after the other. Raises BrokenError where there is none."""
    at = start
    while at < end:
        record = record_at(data, at, end)
        at = record.end
        yield record


def fields_at(data: FileBytes, at: int, end: int, what: str) -> tuple[dict[bytes, bytes], int]:
    """Fields that begin with their common length, and the byte behind them. Raises BrokenError."""
    if at + LENGTH.size > end:
        raise DamagedBagError(at, f"it ends within {what}")
    (size,) = LENGTH.unpack_from(data, at)
    begin, stop = at + LENGTH.size, at + LENGTH.size + size
    if stop > end:
        raise DamagedBagError(at, f"it ends within {what}")
    return named(data, begin, stop, at), stop


def named(data: FileBytes, begin: int, stop: int, at: int) -> dict[bytes, bytes]:
    """The fields in some bytes; `at` is what an error names. Raises BrokenError."""
    fields = {}
    while begin < stop:
        if begin + LENGTH.size > stop:
            raise DamagedBagError(at, "a field is longer than what holds it")
        (size,) = LENGTH.unpack_from(data, begin)
        begin += LENGTH.size
        if begin + size > stop:
            raise DamagedBagError(at, "a field is longer than what holds it")
        name, equals, value = data[begin : begin + size].partition(b"=")
        if not equals:
            raise DamagedBagError(at, "a field without a name")
        fields[name] = value
        begin += size
    return fields


def after_index(data: FileBytes, record: BagRecord) -> int:
    """The byte behind a record of the index, whose length some recorders have written wrong.

    Raises BrokenError when no record begins where one has to.
    """
    entries = record.begin + ENTRY[record.kind] * record.number(b"count")
    for at in (record.end, entries):
        if at == len(data) or (at < len(data) and _is_record(data, at)):
            return at
    raise DamagedBagError(record.at, "a record of the index has a wrong length", in_index=True)


def next_chunk(data: FileBytes, start: int) -> int | None:
    """The byte at or behind `start` where the next chunk begins that is whole; None where there is none."""
    found = data.find(CHUNK_FIELD, start)
    while found >= 0:
        for at in range(found - LENGTH.size, max(start, found - LONGEST_CHUNK_HEADER) - 1, -1):
            (size,) = LENGTH.unpack_from(data, at)
            if found + len(CHUNK_FIELD) - at - LENGTH.size <= size < LONGEST_CHUNK_HEADER and _is_record(
                data, at
            ):
                return at
        found = data.find(CHUNK_FIELD, found + 1)
    return None


def _is_record(data: FileBytes, at: int) -> bool:
    try:
        record_at(data, at, len(data))
    except DamagedBagError:
        return False
    return True
