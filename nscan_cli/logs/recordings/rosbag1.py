"""The container of ROS 1 bags (format 2.0): bytes → messages, front to back, whatever their index says.

A recorder that was killed leaves no index, and some have written a wrong one. So the records are walked,
and the index only tells what should be there.
"""

from __future__ import annotations

import struct
from bz2 import BZ2Decompressor
from collections.abc import Callable
from typing import Any

from nscan_cli.errors import InputDataError
from nscan_cli.files.inputs import FileBytes
from nscan_cli.files.limits import INPUT, MB
from nscan_cli.logs.recordings.container import DAMAGED, WANTED, Channel, Recording, ros_name
from nscan_cli.logs.recordings.rosbag1_records import (
    CHUNK,
    CHUNK_INFO,
    CONNECTION,
    HEADER,
    INDEX,
    LONG,
    MAGIC,
    MESSAGE,
    BagRecord,
    DamagedBagError,
    after_index,
    named,
    next_chunk,
    record_at,
    records,
)

COUNT = struct.Struct("<II")
"""A connection, and how many messages of it a chunk has."""
WALKED = "its messages were found by walking through it"


def recording(data: FileBytes, file: str, salvage: bool) -> Recording:
    """All messages that are of use, in order of their log times. Raises InputDataError and ExceededError."""
    walk = _Walk(data, file, salvage)
    walk.read()
    return walk.recording


class _Walk:
    def __init__(self, data: FileBytes, file: str, salvage: bool) -> None:
        self.data, self.file, self.salvage = data, file, salvage
        self.channels: dict[int, Channel] = {}
        self.in_chunks: dict[int, dict[int, int]] = {}
        """Byte where a chunk begins → messages in it by connection."""
        self.recording = Recording("ROS 1 bag")

    def read(self) -> None:
        """Walk through the file."""
        try:
            header = record_at(self.data, len(MAGIC), len(self.data))
            if header.kind != HEADER:
                raise DamagedBagError(header.at, "its header is missing")
            index_at = header.number(b"index_pos", LONG)
        except DamagedBagError as broken:
            raise self._damaged(broken) from broken
        if header.fields.get(b"encryptor"):
            problem = f"is encrypted, by {header.text(b'encryptor')}"
            raise InputDataError(self.file, problem, "give it as it was before `rosbag encrypt`")
        if index_at > len(self.data):
            self._lost(DamagedBagError(len(self.data), "its end is missing"))
        promised = self._promised(index_at) if 0 < index_at <= len(self.data) else {}
        sound = self._walked(header.end)
        if index_at == 0:
            problem = "the bag has no index, since its recorder did not close it"
            self.recording.warnings.append(f"{problem}: {WALKED}")
        elif not self.recording.warnings and not (sound and promised == self.in_chunks):
            self.recording.warnings.append(f"the index of the bag is wrong: {WALKED}")
        for messages in self.recording.messages.values():
            messages.sort(key=lambda message: message.log_time)

    def _promised(self, index_at: int) -> dict[int, dict[int, int]] | None:
        """What the index says of the chunks; None when it cannot be read. What it defines is taken up."""
        promised: dict[int, dict[int, int]] = {}
        try:
            for record in records(self.data, index_at, len(self.data)):
                if record.kind == CONNECTION:
                    self._connect(record, self.data)
                elif record.kind == CHUNK_INFO:
                    pairs = COUNT.iter_unpack(
                        self.data[record.begin : record.end][: 8 * record.number(b"count")]
                    )
                    promised[record.number(b"chunk_pos", LONG)] = dict(pairs)
        except (DamagedBagError, struct.error):
            return None
        return promised

    def _walked(self, start: int) -> bool:
        """Take up all records from a byte on; whether those of the index have the lengths they should."""
        at: int | None = start
        sound = True
        while at is not None and at < len(self.data):
            try:
                record = record_at(self.data, at, len(self.data))
                if record.kind in (INDEX, CHUNK_INFO):
                    at = after_index(self.data, record)
                    sound &= at == record.end
                    continue
                if record.kind == CHUNK:
                    self._chunk(record)
                else:
                    self._take(record, self.data, {})
                at = record.end
            except DamagedBagError as broken:
                if broken.in_index:
                    sound = False
                else:
                    self._lost(broken)
                at = next_chunk(self.data, at + 1)
        return sound

    def _chunk(self, chunk: BagRecord) -> None:
        """Take up what is in a chunk. Of one that was never ended, the records follow it as they are."""
        counts = self.in_chunks.setdefault(chunk.at, {})
        try:
            content: FileBytes = self.data
            begin, end = chunk.begin, chunk.end
            if chunk.text(b"compression") != "none" and begin < end:
                content = self._unpacked(chunk)
                begin, end = 0, len(content)
            for record in records(content, begin, end):
                self._take(record, content, counts)
        except DamagedBagError as broken:
            self._lost(DamagedBagError(chunk.at, f"a chunk is damaged: {broken}"))

    def _unpacked(self, chunk: BagRecord) -> bytes:
        """What is in a compressed chunk, no longer than it says itself. Raises ExceededError."""
        size, compression = chunk.number(b"size"), chunk.text(b"compression")
        INPUT.check(size / MB, f"has a chunk of {size / MB:,.0f} MB")
        if compression not in UNPACKERS:
            raise DamagedBagError(chunk.at, f"compressed by {compression!r}, which is not known")
        try:
            packed = self.data[chunk.begin : chunk.end]
            content: bytes = UNPACKERS[compression]().decompress(packed, max_length=size + 1)
        except Exception as error:
            # OSError of bz2, RuntimeError and others of LZ4.
            raise DamagedBagError(chunk.at, " ".join(str(error).split())) from error
        if len(content) != size:
            raise DamagedBagError(chunk.at, "not of the length that it should have")
        self.recording.pass_on(size)
        return content

    def _take(self, record: BagRecord, content: FileBytes, counts: dict[int, int]) -> None:
        """Take up a record that defines a connection, or a message."""
        if record.kind == CONNECTION:
            self._connect(record, content)
        elif record.kind == MESSAGE:
            number = record.number(b"conn")
            channel = self.channels.get(number)
            if channel is None:
                raise DamagedBagError(record.at, f"a message of connection {number}, which is not defined")
            counts[number] = counts.get(number, 0) + 1
            self.recording.counts[channel] += 1
            if channel.type in WANTED:
                self.recording.keep(channel, record.time(), content[record.begin : record.end])
        else:
            raise DamagedBagError(record.at, "a record that does not belong there")

    def _connect(self, record: BagRecord, content: FileBytes) -> None:
        number = record.number(b"conn")
        if number in self.channels:
            return
        says = record._replace(fields=named(content, record.begin, record.end, record.at))
        name, definition = says.text(b"type"), says.text(b"message_definition")
        channel = Channel(record.text(b"topic"), ros_name(name), "ros1", "ros1msg", definition.encode())
        self.channels[number] = channel
        self.recording.counts[channel] = 0

    def _lost(self, broken: DamagedBagError) -> None:
        """Damage: an error, or under --salvage a warning."""
        error = self._damaged(broken)
        if not self.salvage:
            raise error from broken
        self.recording.warnings.append(f"{_said(broken)}: what is whole is used")

    def _damaged(self, broken: DamagedBagError) -> InputDataError:
        return InputDataError(self.file, _said(broken), DAMAGED)


def _lz4() -> Any:
    from lz4.frame import LZ4FrameDecompressor

    return LZ4FrameDecompressor()


UNPACKERS: dict[str, Callable[[], Any]] = {"bz2": BZ2Decompressor, "lz4": _lz4}


def _said(broken: DamagedBagError) -> str:
    return f"the bag is damaged or cut off at byte {broken.at} ({broken})"
