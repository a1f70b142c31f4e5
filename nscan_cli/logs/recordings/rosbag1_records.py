"""The records of ROS 1 bags (format 2.0), and the fields of their headers.

Source: wiki.ros.org/Bags/Format/2.0. A record is a header of named fields, then data; both begin with their
length.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import NamedTuple

from nscan_cli.files.inputs import FileBytes

UINT32, UINT64, ROS_TIME = struct.Struct("<I"), struct.Struct("<Q"), struct.Struct("<II")
BAG_MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, BAG_HEADER, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7
"""Types of records: the field op of their headers."""
INDEX_ENTRY_SIZE = {INDEX: 12, CHUNK_INFO: 8}
"""Bytes of each entry in the two types of records that make up the index."""
CHUNK_FIELD = b"\x04\x00\x00\x00op=\x05"
"""The field op in the header of a chunk, with its length."""
LONGEST_CHUNK_HEADER = 200
"""Bytes: the length field and the named fields of a chunk's header are shorter."""


class DamagedBagError(Exception):
    """No valid record begins at a byte."""

    def __init__(self, at: int, problem: str, in_index: bool = False) -> None:
        super().__init__(problem)
        self.at, self.in_index = at, in_index
        """in_index: only a record of the index is broken, so that no message is lost."""


class BagRecord(NamedTuple):
    """One record: the byte where it begins, its type, its fields, and where its data begin and end."""

    at: int
    op: int
    fields: dict[bytes, bytes]
    begin: int
    end: int

    def number(self, name: bytes, form: struct.Struct = UINT32) -> int:
        """A field with a number. Raises DamagedBagError when it is missing or of another length."""
        return int(form.unpack(self._field(name, form.size))[0])

    def time(self) -> int:
        """The field time, ns. Raises DamagedBagError when it is missing or of another length."""
        seconds, nanoseconds = ROS_TIME.unpack(self._field(b"time", ROS_TIME.size))
        return int(seconds) * 10**9 + int(nanoseconds)

    def text(self, name: bytes) -> str:
        """A field with text. Raises DamagedBagError when it is missing."""
        if name not in self.fields:
            raise DamagedBagError(self.at, f"a record without {name.decode()}")
        return self.fields[name].decode("utf-8", "replace")

    def _field(self, name: bytes, size: int) -> bytes:
        value = self.fields.get(name, b"")
        if len(value) != size:
            raise DamagedBagError(self.at, f"a record without {name.decode()}")
        return value


def record_at(data: FileBytes, at: int, end: int) -> BagRecord:
    """The record that begins at a byte and ends before `end`. Raises DamagedBagError when there is none."""
    if at + UINT32.size > end:
        raise DamagedBagError(at, "it ends within a record's header")
    (size,) = UINT32.unpack_from(data, at)
    first, begin = at + UINT32.size, at + UINT32.size + size
    if begin > end:
        raise DamagedBagError(at, "it ends within a record's header")
    fields = parse_fields(data, first, begin, at)
    if begin + UINT32.size > end:
        raise DamagedBagError(at, "it ends within a record")
    (size,) = UINT32.unpack_from(data, begin)
    begin += UINT32.size
    op_field = fields.get(b"op", b"")
    op = op_field[0] if len(op_field) == 1 else 0
    if not MESSAGE <= op <= CONNECTION:
        raise DamagedBagError(at, "a record of no known kind")
    if begin + size > end:
        raise DamagedBagError(at, "it ends within a record", op in INDEX_ENTRY_SIZE)
    return BagRecord(at, op, fields, begin, begin + size)


def records(data: FileBytes, start: int, end: int) -> Iterator[BagRecord]:
    """The records in a range of bytes. Raises DamagedBagError where none begins."""
    at = start
    while at < end:
        record = record_at(data, at, end)
        at = record.end
        yield record


def parse_fields(data: FileBytes, begin: int, stop: int, at: int) -> dict[bytes, bytes]:
    """The fields in a range of bytes. Raises DamagedBagError, which names the byte `at`."""
    fields = {}
    while begin < stop:
        if begin + UINT32.size > stop:
            raise DamagedBagError(at, "a field is longer than what holds it")
        (size,) = UINT32.unpack_from(data, begin)
        begin += UINT32.size
        if begin + size > stop:
            raise DamagedBagError(at, "a field is longer than what holds it")
        name, equals, value = data[begin : begin + size].partition(b"=")
        if not equals:
            raise DamagedBagError(at, "a field without a name")
        fields[name] = value
        begin += size
    return fields


def after_index(data: FileBytes, record: BagRecord) -> int:
    """The byte behind a record of the index, whose length some recorders write wrong.

    Raises DamagedBagError when no record begins there, by its length or by its number of entries.
    """
    entries = record.begin + INDEX_ENTRY_SIZE[record.op] * record.number(b"count")
    for at in (record.end, entries):
        if at == len(data) or (at < len(data) and _is_record(data, at)):
            return at
    raise DamagedBagError(record.at, "a record of the index has a wrong length", in_index=True)


def next_chunk(data: FileBytes, start: int) -> int | None:
    """The byte where the next whole chunk begins, from `start` on; None without one."""
    found = data.find(CHUNK_FIELD, start)
    while found >= 0:
        for at in range(found - UINT32.size, max(start, found - LONGEST_CHUNK_HEADER) - 1, -1):
            (size,) = UINT32.unpack_from(data, at)
            if found + len(CHUNK_FIELD) - at - UINT32.size <= size < LONGEST_CHUNK_HEADER and _is_record(
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
