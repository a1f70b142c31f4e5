"""The container of ROS 1 bags (format 2.0): bytes → messages.

All records are read from front to back: a recorder that was killed leaves no index, and some recorders
write a wrong one. The index is only compared with what was found.
"""

from __future__ import annotations

import struct

from nscan_cli.errors import InputDataError
from nscan_cli.files.inputs import FileBytes
from nscan_cli.files.limits import INPUT, MB
from nscan_cli.logs.compression import BZIP2, LZ4
from nscan_cli.logs.recordings.container import DAMAGE_REMEDY, Channel, Recording
from nscan_cli.logs.recordings.message_types import READ_TYPES, ros2_type_name
from nscan_cli.logs.recordings.rosbag1_records import (
    BAG_HEADER,
    BAG_MAGIC,
    CHUNK,
    CHUNK_INFO,
    CONNECTION,
    INDEX,
    MESSAGE,
    UINT64,
    BagRecord,
    DamagedBagError,
    after_index,
    next_chunk,
    parse_fields,
    record_at,
    records,
)

CHUNK_COUNT = struct.Struct("<II")
"""A connection, and how many of its messages a chunk has."""
DECOMPRESSORS = {"bz2": BZIP2.new, "lz4": LZ4.new}
WHOLE_READ = "its messages were found by reading all of it"


def read_recording(data: FileBytes, file: str, salvage: bool) -> Recording:
    """The messages in order of their log times. Raises InputDataError and LimitExceededError."""
    return _BagReader(data, file, salvage).read()


class _BagReader:
    def __init__(self, data: FileBytes, file: str, salvage: bool) -> None:
        self.data, self.file, self.salvage = data, file, salvage
        self.channels: dict[int, Channel] = {}
        self.in_chunks: dict[int, dict[int, int]] = {}
        """Byte where a chunk begins → number of its messages by connection."""
        self.recording = Recording("ROS 1 bag")

    def read(self) -> Recording:
        """Read the whole file."""
        try:
            header = record_at(self.data, len(BAG_MAGIC), len(self.data))
            if header.op != BAG_HEADER:
                raise DamagedBagError(header.at, "its header is missing")
            index_at = header.number(b"index_pos", UINT64)
        except DamagedBagError as broken:
            raise self._damaged(broken) from broken
        if header.fields.get(b"encryptor"):
            problem = f"is encrypted, by {header.text(b'encryptor')}"
            raise InputDataError(self.file, problem, "give it as it was before `rosbag encrypt`")
        if index_at > len(self.data):
            self._lost(DamagedBagError(len(self.data), "its end is missing"))
        indexed = self._read_index(index_at) if 0 < index_at <= len(self.data) else {}
        index_is_sound = self._read_records(header.end)
        if index_at == 0:
            problem = "the bag has no index, since its recorder did not close it"
            self.recording.warnings.append(f"{problem}: {WHOLE_READ}")
        elif not self.recording.warnings and not (index_is_sound and indexed == self.in_chunks):
            self.recording.warnings.append(f"the index of the bag is wrong: {WHOLE_READ}")
        for messages in self.recording.messages.values():
            messages.sort(key=lambda message: message.log_time)
        return self.recording

    def _read_index(self, index_at: int) -> dict[int, dict[int, int]] | None:
        """What `in_chunks` should be by the index; None when it cannot be read. Adds its connections."""
        indexed: dict[int, dict[int, int]] = {}
        try:
            for record in records(self.data, index_at, len(self.data)):
                if record.op == CONNECTION:
                    self._add_connection(record, self.data)
                elif record.op == CHUNK_INFO:
                    pairs = CHUNK_COUNT.iter_unpack(
                        self.data[record.begin : record.end][: 8 * record.number(b"count")]
                    )
                    indexed[record.number(b"chunk_pos", UINT64)] = dict(pairs)
        except (DamagedBagError, struct.error):
            return None
        return indexed

    def _read_records(self, start: int) -> bool:
        """Read all records from a byte on; whether those of the index have the right lengths."""
        at: int | None = start
        index_is_sound = True
        while at is not None and at < len(self.data):
            try:
                record = record_at(self.data, at, len(self.data))
                if record.op in (INDEX, CHUNK_INFO):
                    at = after_index(self.data, record)
                    index_is_sound &= at == record.end
                    continue
                if record.op == CHUNK:
                    self._read_chunk(record)
                else:
                    self._add_record(record, self.data, {})
                at = record.end
            except DamagedBagError as broken:
                if broken.in_index:
                    index_is_sound = False
                else:
                    self._lost(broken)
                at = next_chunk(self.data, at + 1)
        return index_is_sound

    def _read_chunk(self, chunk: BagRecord) -> None:
        """Read the records in a chunk. Those of a chunk that was never closed follow it, not compressed."""
        counts = self.in_chunks.setdefault(chunk.at, {})
        try:
            content: FileBytes = self.data
            begin, end = chunk.begin, chunk.end
            if chunk.text(b"compression") != "none" and begin < end:
                content = self._unpacked(chunk)
                begin, end = 0, len(content)
            for record in records(content, begin, end):
                self._add_record(record, content, counts)
        except DamagedBagError as broken:
            self._lost(DamagedBagError(chunk.at, f"a chunk is damaged: {broken}"))

    def _unpacked(self, chunk: BagRecord) -> bytes:
        """The content of a compressed chunk, up to the size that it states. Raises LimitExceededError."""
        size, compression = chunk.number(b"size"), chunk.text(b"compression")
        INPUT.check(size / MB, f"has a chunk of {size / MB:,.0f} MB")
        if compression not in DECOMPRESSORS:
            raise DamagedBagError(chunk.at, f"compressed by {compression!r}, which is not known")
        try:
            packed = self.data[chunk.begin : chunk.end]
            content: bytes = DECOMPRESSORS[compression]().decompress(packed, max_length=size + 1)
        except Exception as error:
            # bz2 raises OSError; LZ4 raises RuntimeError and others.
            raise DamagedBagError(chunk.at, " ".join(str(error).split())) from error
        if len(content) != size:
            raise DamagedBagError(chunk.at, "not of the length that it should have")
        self.recording.add_unpacked(size)
        return content

    def _add_record(self, record: BagRecord, content: FileBytes, counts: dict[int, int]) -> None:
        """Add a connection or a message."""
        if record.op == CONNECTION:
            self._add_connection(record, content)
        elif record.op == MESSAGE:
            number = record.number(b"conn")
            channel = self.channels.get(number)
            if channel is None:
                raise DamagedBagError(record.at, f"a message of connection {number}, which is not defined")
            counts[number] = counts.get(number, 0) + 1
            self.recording.counts[channel] += 1
            if channel.type in READ_TYPES:
                self.recording.add(channel, record.time(), content[record.begin : record.end])
        else:
            raise DamagedBagError(record.at, "a record that does not belong there")

    def _add_connection(self, record: BagRecord, content: FileBytes) -> None:
        number = record.number(b"conn")
        if number in self.channels:
            return
        details = record._replace(fields=parse_fields(content, record.begin, record.end, record.at))
        name, definition = details.text(b"type"), details.text(b"message_definition")
        channel = Channel(record.text(b"topic"), ros2_type_name(name), "ros1", "ros1msg", definition.encode())
        self.channels[number] = channel
        self.recording.counts[channel] = 0

    def _lost(self, broken: DamagedBagError) -> None:
        """Damage: an error, or under --salvage a warning."""
        if not self.salvage:
            raise self._damaged(broken) from broken
        self.recording.warnings.append(f"{_damage(broken)}: the undamaged part is used")

    def _damaged(self, broken: DamagedBagError) -> InputDataError:
        return InputDataError(self.file, _damage(broken), DAMAGE_REMEDY)


def _damage(broken: DamagedBagError) -> str:
    return f"the bag is damaged or cut off at byte {broken.at} ({broken})"
