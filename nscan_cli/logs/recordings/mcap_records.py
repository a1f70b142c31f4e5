"""The container MCAP: bytes → messages, front to back, with every checksum that the file has.

Source of the form: mcap.dev/spec. The records are walked here and not by the package's readers, which
check no chunk of a file without index, and drop what follows damage without saying where it is.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from nscan_cli.errors import InputDataError
from nscan_cli.files.counting import counted
from nscan_cli.files.inputs import FileBytes
from nscan_cli.files.limits import INPUT, MB
from nscan_cli.logs.recordings.container import DAMAGED, WANTED, Channel, Recording, ros_name

MAGIC = b"\x89MCAP0\r\n"
HEAD, MESSAGE = struct.Struct("<BQ"), struct.Struct("<HIQQ")
FOOTER_SIZE = HEAD.size + 20
IN_DATA = {Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK, Opcode.MESSAGE_INDEX,
           Opcode.ATTACHMENT, Opcode.METADATA, Opcode.DATA_END}  # fmt: skip
IN_CHUNK = {Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE}
IN_SUMMARY = {Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS, Opcode.CHUNK_INDEX, Opcode.ATTACHMENT_INDEX,
              Opcode.METADATA_INDEX, Opcode.SUMMARY_OFFSET, Opcode.FOOTER}  # fmt: skip
PRIVATE = 0x80
"""Opcodes from here on are anyone's own."""
COMPRESSIONS = ("", "lz4", "zstd")


class DamagedMcapError(Exception):
    """The records cannot be followed beyond a byte."""

    def __init__(self, at: int, problem: str) -> None:
        super().__init__(problem)
        self.at = at


UNREADABLE = (
    DamagedMcapError,
    McapError,
    ValueError,
    struct.error,
    zstandard.ZstdError,
    RuntimeError,
    MemoryError,
    OverflowError,
)
"""What the package raises on damage: a checksum is a ValueError, LZ4's complaints are RuntimeErrors."""


@dataclass
class Summary:
    """What the end of the file says about the rest."""

    start: int
    """Byte where the data section has to end."""
    chunks: list[int] = field(default_factory=list)
    """Bytes where chunks begin."""
    counts: dict[int, int] | None = None
    """Messages by channel, where the file says so."""


def read_records(data: FileBytes, file: str, salvage: bool) -> Recording:
    """All messages that scans, odometry and mounting can come from.

    With `salvage`, damaged parts are left out and told in the recording's warnings. Raises InputDataError
    and ExceededError.
    """
    reader = _Reader(data, file, salvage)
    reader.read()
    return reader.recording


class _Reader:
    def __init__(self, data: FileBytes, file: str, salvage: bool) -> None:
        self.data, self.file, self.salvage = data, file, salvage
        self.schemas: dict[int, records.Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.counts: dict[int, int] = {}
        self.recording = Recording("MCAP")
        self.checked = True

    def read(self) -> None:
        """Walk through the file."""
        summary = self._summary()
        try:
            end = self._data_section()
            if summary is not None and end != summary.start:
                self._lost(end, "something stands between the data and the summary")
        except DamagedMcapError as broken:
            self._lost(broken.at, f"{broken}; what follows is not readable")
            self._resume(broken.at, summary)
        counts = None if summary is None else summary.counts
        for number, channel in self.channels.items():
            read = self.counts.get(number, 0)
            self.recording.counts[channel] = self.recording.counts.get(channel, 0) + read
            given = read if counts is None else counts.get(number, 0)
            if given != read:
                self._lost(None, f"{read} of {given} messages on {channel.topic} are readable")
        missing = 0 if counts is None else sum(n for key, n in counts.items() if key not in self.channels)
        if missing:
            self._lost(
                None, f"{counted(missing, 'message')} not readable, on channels that it does not define"
            )
        if self.recording.warnings:
            self.recording.checksums = "some do not fit, or cannot be checked"
        else:
            self.recording.checksums = "they fit" if self.checked else "none over the messages"

    def _lost(self, at: int | None, problem: str) -> None:
        """Damage: an error, or under --salvage a warning."""
        place = "" if at is None else f"at byte {at}: "
        if not self.salvage:
            raise InputDataError(self.file, f"{place}{problem}", DAMAGED)
        self.recording.warnings.append(f"damaged: {place}{problem}")

    def _framed(
        self, data: FileBytes, start: int, end: int, allowed: set[Opcode]
    ) -> Iterator[tuple[int, int, int]]:
        """Opcode, first byte of the content and the byte behind it, of one record after the other."""
        at = start
        while at < end:
            if at + HEAD.size > end:
                raise DamagedMcapError(at, "ends within a record")
            opcode, length = HEAD.unpack_from(data, at)
            if opcode not in allowed and opcode < PRIVATE:
                raise DamagedMcapError(at, f"a record of kind {opcode} does not belong there")
            begin, at = at + HEAD.size, at + HEAD.size + length
            if at > end:
                raise DamagedMcapError(begin - HEAD.size, "a record is longer than what holds it")
            yield opcode, begin, at

    def _summary(self) -> Summary | None:
        """The end of the file; None under --salvage when it is cut off or damaged."""
        size = len(self.data)
        if self.data[-len(MAGIC) :] != MAGIC or size < 2 * len(MAGIC) + FOOTER_SIZE:
            self._lost(size, "the file ends too early")
            return None
        footer_at = size - len(MAGIC) - FOOTER_SIZE
        opcode, length = HEAD.unpack_from(self.data, footer_at)
        start, _, crc = struct.unpack_from("<QQI", self.data, footer_at + HEAD.size)
        if opcode != Opcode.FOOTER or length != 20 or start > footer_at:
            self._lost(footer_at, "the end of the file is damaged")
            return None
        start = start or footer_at
        found = zlib.crc32(memoryview(self.data)[start : size - len(MAGIC) - 4])
        if crc not in (0, found):
            self._lost(start, "the summary does not fit its checksum")
            return None
        try:
            return self._summary_records(Summary(start), size - len(MAGIC))
        except UNREADABLE as error:
            self._lost(start, f"the summary is damaged ({_said(error)})")
            return None

    def _summary_records(self, summary: Summary, end: int) -> Summary:
        for opcode, begin, stop in self._framed(self.data, summary.start, end, IN_SUMMARY):
            if opcode == Opcode.STATISTICS:
                statistics = records.Statistics.read(_stream(self.data, begin, stop))
                summary.counts = dict(statistics.channel_message_counts)
            elif opcode == Opcode.CHUNK_INDEX:
                index = records.ChunkIndex.read(_stream(self.data, begin, stop))
                summary.chunks.append(index.chunk_start_offset)
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._define(opcode, self.data, begin, stop)
        return summary

    def _data_section(self) -> int:
        """Read it; the byte behind it."""
        data = self.data
        loose = False
        for opcode, begin, stop in self._framed(data, len(MAGIC), len(data), IN_DATA):
            if opcode == Opcode.CHUNK:
                self._chunk(begin, stop)
            elif opcode == Opcode.DATA_END:
                if stop - begin < 4:
                    raise DamagedMcapError(begin - HEAD.size, "the end of the data is damaged")
                (crc,) = struct.unpack_from("<I", data, begin)
                if crc not in (0, zlib.crc32(memoryview(data)[: begin - HEAD.size])):
                    self._lost(None, f"its bytes 0 to {begin - HEAD.size} do not fit their checksum")
                self.checked &= bool(crc) or not loose
                return stop
            else:
                loose |= opcode == Opcode.MESSAGE
                try:
                    self._record(opcode, data, begin, stop)
                except UNREADABLE as error:
                    self._lost(begin - HEAD.size, f"a record is damaged ({_said(error)})")
        raise DamagedMcapError(len(data), "the data section has no end")

    def _resume(self, broken_at: int, summary: Summary | None) -> None:
        """Read the chunks behind a byte from which on the records cannot be followed."""
        for start in (
            [] if summary is None else sorted(start for start in summary.chunks if start > broken_at)
        ):
            try:
                opcode, begin, stop = next(self._framed(self.data, start, len(self.data), {Opcode.CHUNK}))
            except (DamagedMcapError, StopIteration):
                continue
            if opcode == Opcode.CHUNK:
                self._chunk(begin, stop)

    def _chunk(self, begin: int, stop: int) -> None:
        at = begin - HEAD.size
        try:
            chunk = records.Chunk.read(_stream(self.data, begin, stop))
            if chunk.compression not in COMPRESSIONS:
                raise DamagedMcapError(at, f"compressed by {chunk.compression!r}, which is not known")
            self.checked &= chunk.uncompressed_crc != 0
            content = self._unpacked(chunk)
            if len(content) != chunk.uncompressed_size:
                raise DamagedMcapError(at, "not of the length that it should have")
            if chunk.uncompressed_crc not in (0, zlib.crc32(content)):
                raise DamagedMcapError(at, "it does not fit its checksum")
            for opcode, first, last in self._framed(content, 0, len(content), IN_CHUNK):
                self._record(opcode, content, first, last)
        except UNREADABLE as error:
            self._lost(at, f"a chunk is damaged ({_said(error)})")

    def _unpacked(self, chunk: records.Chunk) -> bytes:
        """What is in a chunk, no longer than it says itself. Raises ExceededError when that is too much."""
        size: int = chunk.uncompressed_size
        INPUT.check(size / MB, f"has a chunk of {size / MB:,.0f} MB")
        if chunk.compression == "lz4":
            from lz4.frame import LZ4FrameDecompressor

            content: bytes = LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
        elif chunk.compression == "zstd":
            # What the packed data say of their length is what the package takes memory for.
            if zstandard.frame_content_size(chunk.data) > size:
                raise DamagedMcapError(0, "not of the length that it should have")
            content = zstandard.ZstdDecompressor().decompress(chunk.data, max_output_size=size)
        else:
            content = chunk.data
        self.recording.pass_on(len(content))
        return content

    def _record(self, opcode: int, data: FileBytes, begin: int, stop: int) -> None:
        """Take up a record that defines something, or a message."""
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self._define(opcode, data, begin, stop)
        elif opcode == Opcode.MESSAGE:
            if stop - begin < MESSAGE.size:
                raise DamagedMcapError(begin, "a message is too short")
            number, _, log_time, _ = MESSAGE.unpack_from(data, begin)
            channel = self.channels.get(number)
            if channel is None:
                raise DamagedMcapError(begin, f"a message of channel {number}, which is not defined")
            self.counts[number] = self.counts.get(number, 0) + 1
            if channel.type in WANTED:
                self.recording.keep(channel, log_time, data[begin + MESSAGE.size : stop])

    def _define(self, opcode: int, data: FileBytes, begin: int, stop: int) -> None:
        if opcode == Opcode.SCHEMA:
            schema = records.Schema.read(_stream(data, begin, stop))
            self.schemas[schema.id] = schema
            return
        channel = records.Channel.read(_stream(data, begin, stop))
        if channel.id in self.channels:
            return
        known = self.schemas.get(channel.schema_id)
        if known is None and channel.schema_id != 0:
            raise DamagedMcapError(begin, f"channel {channel.id} is of a schema that is not defined")
        name, form, text = ("", "", b"") if known is None else (known.name, known.encoding, known.data)
        made = Channel(channel.topic, ros_name(name), channel.message_encoding, form, text)
        self.channels[channel.id] = made


def _stream(data: FileBytes, begin: int, stop: int) -> Any:
    return ReadDataStream(io.BytesIO(data[begin:stop]))


def _said(error: BaseException) -> str:
    """An error of the package in a few words."""
    text = " ".join(str(error).split())
    return text if text else type(error).__name__
