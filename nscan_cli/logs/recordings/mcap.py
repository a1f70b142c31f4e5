"""The container MCAP (ROS 1, ROS 2, Foxglove): bytes → messages, with every checksum that the file has.

Source: mcap.dev/spec. The records are read here and not by the readers of the package mcap: those check no
chunk of a file without index, and do not say where damage begins.
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
from nscan_cli.files.inputs import FileBytes
from nscan_cli.files.limits import INPUT, MB
from nscan_cli.files.text import counted
from nscan_cli.logs.compression import LZ4
from nscan_cli.logs.recordings.container import DAMAGE_REMEDY, Channel, Recording
from nscan_cli.logs.recordings.message_types import READ_TYPES, ros2_type_name

MCAP_MAGIC = b"\x89MCAP0\r\n"
RECORD_HEADER, MESSAGE_HEADER = struct.Struct("<BQ"), struct.Struct("<HIQQ")
FOOTER_SIZE = RECORD_HEADER.size + 20
DATA_OPCODES = {Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK,
                Opcode.MESSAGE_INDEX, Opcode.ATTACHMENT, Opcode.METADATA, Opcode.DATA_END}  # fmt: skip
CHUNK_OPCODES = {Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE}
SUMMARY_OPCODES = {Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS, Opcode.CHUNK_INDEX,
                   Opcode.ATTACHMENT_INDEX, Opcode.METADATA_INDEX, Opcode.SUMMARY_OFFSET,
                   Opcode.FOOTER}  # fmt: skip
FIRST_PRIVATE_OPCODE = 0x80
"""Opcodes from here on are free for applications."""
CHUNK_COMPRESSIONS = ("", "lz4", "zstd")


class DamagedMcapError(Exception):
    """No valid record begins at a byte."""

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
"""Errors that the packages raise on damage: ValueError for a checksum, RuntimeError in LZ4."""


@dataclass
class Summary:
    """The summary section at the end of the file."""

    start: int
    """Byte where the data section must end."""
    chunks: list[int] = field(default_factory=list)
    """Bytes where chunks begin."""
    counts: dict[int, int] | None = None
    """Number of messages by channel; None where the file does not state it."""


def read_recording(data: FileBytes, file: str, salvage: bool) -> Recording:
    """The messages in file order.

    With `salvage`, damaged parts are left out, with a warning in the recording; else they are an error.
    Raises InputDataError and LimitExceededError.
    """
    return _McapReader(data, file, salvage).read()


class _McapReader:
    def __init__(self, data: FileBytes, file: str, salvage: bool) -> None:
        self.data, self.file, self.salvage = data, file, salvage
        self.schemas: dict[int, records.Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.counts: dict[int, int] = {}
        self.recording = Recording("MCAP")
        self.checked = True

    def read(self) -> Recording:
        """Read the whole file."""
        summary = self._read_summary()
        try:
            end = self._read_data_section()
            if summary is not None and end != summary.start:
                self._lost(end, "unknown bytes stand between the data and the summary")
        except DamagedMcapError as broken:
            self._lost(broken.at, f"{broken}; what follows is not readable")
            self._resume_at_chunks(broken.at, summary)
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
            self.recording.checksums = "they fit" if self.checked else "the file has none of its messages"
        return self.recording

    def _lost(self, at: int | None, problem: str) -> None:
        """Damage: an error, or under --salvage a warning."""
        place = "" if at is None else f"at byte {at}: "
        if not self.salvage:
            raise InputDataError(self.file, f"{place}{problem}", DAMAGE_REMEDY)
        self.recording.warnings.append(f"damaged: {place}{problem}")

    def _records(
        self, data: FileBytes, start: int, end: int, allowed: set[Opcode]
    ) -> Iterator[tuple[int, int, int]]:
        """Opcode, first byte of the content and the byte behind it, of each record."""
        at = start
        while at < end:
            if at + RECORD_HEADER.size > end:
                raise DamagedMcapError(at, "ends within a record")
            opcode, length = RECORD_HEADER.unpack_from(data, at)
            if opcode not in allowed and opcode < FIRST_PRIVATE_OPCODE:
                raise DamagedMcapError(at, f"a record of kind {opcode} does not belong there")
            begin, at = at + RECORD_HEADER.size, at + RECORD_HEADER.size + length
            if at > end:
                raise DamagedMcapError(begin - RECORD_HEADER.size, "a record is longer than what holds it")
            yield opcode, begin, at

    def _read_summary(self) -> Summary | None:
        """The summary section; None under --salvage when it is cut off or damaged."""
        size = len(self.data)
        if self.data[-len(MCAP_MAGIC) :] != MCAP_MAGIC or size < 2 * len(MCAP_MAGIC) + FOOTER_SIZE:
            self._lost(size, "the file ends too early")
            return None
        footer_at = size - len(MCAP_MAGIC) - FOOTER_SIZE
        opcode, length = RECORD_HEADER.unpack_from(self.data, footer_at)
        start, _, crc = struct.unpack_from("<QQI", self.data, footer_at + RECORD_HEADER.size)
        if opcode != Opcode.FOOTER or length != 20 or start > footer_at:
            self._lost(footer_at, "the end of the file is damaged")
            return None
        start = start or footer_at
        found = zlib.crc32(memoryview(self.data)[start : size - len(MCAP_MAGIC) - 4])
        if crc not in (0, found):
            self._lost(start, "the summary does not fit its checksum")
            return None
        try:
            return self._read_summary_records(Summary(start), size - len(MCAP_MAGIC))
        except UNREADABLE as error:
            self._lost(start, f"the summary is damaged ({_in_one_line(error)})")
            return None

    def _read_summary_records(self, summary: Summary, end: int) -> Summary:
        for opcode, begin, stop in self._records(self.data, summary.start, end, SUMMARY_OPCODES):
            if opcode == Opcode.STATISTICS:
                statistics = records.Statistics.read(_stream(self.data, begin, stop))
                summary.counts = dict(statistics.channel_message_counts)
            elif opcode == Opcode.CHUNK_INDEX:
                index = records.ChunkIndex.read(_stream(self.data, begin, stop))
                summary.chunks.append(index.chunk_start_offset)
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._define(opcode, self.data, begin, stop)
        return summary

    def _read_data_section(self) -> int:
        """Read the data section; the byte behind it."""
        data = self.data
        unchecked_messages = False
        for opcode, begin, stop in self._records(data, len(MCAP_MAGIC), len(data), DATA_OPCODES):
            if opcode == Opcode.CHUNK:
                self._read_chunk(begin, stop)
            elif opcode == Opcode.DATA_END:
                if stop - begin < 4:
                    raise DamagedMcapError(begin - RECORD_HEADER.size, "the end of the data is damaged")
                (crc,) = struct.unpack_from("<I", data, begin)
                if crc not in (0, zlib.crc32(memoryview(data)[: begin - RECORD_HEADER.size])):
                    self._lost(None, f"its bytes 0 to {begin - RECORD_HEADER.size} do not fit their checksum")
                self.checked &= bool(crc) or not unchecked_messages
                return stop
            else:
                unchecked_messages |= opcode == Opcode.MESSAGE
                try:
                    self._add_record(opcode, data, begin, stop)
                except UNREADABLE as error:
                    self._lost(begin - RECORD_HEADER.size, f"a record is damaged ({_in_one_line(error)})")
        raise DamagedMcapError(len(data), "the data section has no end")

    def _resume_at_chunks(self, broken_at: int, summary: Summary | None) -> None:
        """Read the chunks behind a damaged byte, at the places that the summary has."""
        for start in sorted(start for start in (summary.chunks if summary else ()) if start > broken_at):
            try:
                opcode, begin, stop = next(self._records(self.data, start, len(self.data), {Opcode.CHUNK}))
            except (DamagedMcapError, StopIteration):
                continue
            if opcode == Opcode.CHUNK:
                self._read_chunk(begin, stop)

    def _read_chunk(self, begin: int, stop: int) -> None:
        at = begin - RECORD_HEADER.size
        try:
            chunk = records.Chunk.read(_stream(self.data, begin, stop))
            if chunk.compression not in CHUNK_COMPRESSIONS:
                raise DamagedMcapError(at, f"compressed by {chunk.compression!r}, which is not known")
            self.checked &= chunk.uncompressed_crc != 0
            content = self._unpacked(chunk)
            if len(content) != chunk.uncompressed_size:
                raise DamagedMcapError(at, "not of the length that it should have")
            if chunk.uncompressed_crc not in (0, zlib.crc32(content)):
                raise DamagedMcapError(at, "it does not fit its checksum")
            for opcode, first, last in self._records(content, 0, len(content), CHUNK_OPCODES):
                self._add_record(opcode, content, first, last)
        except UNREADABLE as error:
            self._lost(at, f"a chunk is damaged ({_in_one_line(error)})")

    def _unpacked(self, chunk: records.Chunk) -> bytes:
        """The content of a chunk, up to the size that it states. Raises LimitExceededError beyond it."""
        size: int = chunk.uncompressed_size
        INPUT.check(size / MB, f"has a chunk of {size / MB:,.0f} MB")
        if chunk.compression == "lz4":
            content: bytes = LZ4.new().decompress(chunk.data, max_length=size + 1)
        elif chunk.compression == "zstd":
            # The package allocates the size that the compressed data state.
            if zstandard.frame_content_size(chunk.data) > size:
                raise DamagedMcapError(0, "not of the length that it should have")
            content = zstandard.ZstdDecompressor().decompress(chunk.data, max_output_size=size)
        else:
            content = chunk.data
        self.recording.add_unpacked(len(content))
        return content

    def _add_record(self, opcode: int, data: FileBytes, begin: int, stop: int) -> None:
        """Add a schema, a channel or a message."""
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self._define(opcode, data, begin, stop)
        elif opcode == Opcode.MESSAGE:
            if stop - begin < MESSAGE_HEADER.size:
                raise DamagedMcapError(begin, "a message is too short")
            number, _, log_time, _ = MESSAGE_HEADER.unpack_from(data, begin)
            channel = self.channels.get(number)
            if channel is None:
                raise DamagedMcapError(begin, f"a message of channel {number}, which is not defined")
            self.counts[number] = self.counts.get(number, 0) + 1
            if channel.type in READ_TYPES:
                self.recording.add(channel, log_time, data[begin + MESSAGE_HEADER.size : stop])

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
        self.channels[channel.id] = Channel(
            channel.topic, ros2_type_name(name), channel.message_encoding, form, text
        )


def _stream(data: FileBytes, begin: int, stop: int) -> Any:
    return ReadDataStream(io.BytesIO(data[begin:stop]))


def _in_one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__
