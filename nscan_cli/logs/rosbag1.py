"""ROS 1 bags (format 2.0), read by rosbags."""

from __future__ import annotations

import io
from bz2 import BZ2Decompressor
from collections.abc import Callable
from typing import Any

from nscan_cli.errors import InputDataError
from nscan_cli.limits import INPUT, ExceededError
from nscan_cli.logs import recorded
from nscan_cli.logs.options import ReadingOptions
from nscan_cli.logs.recording import WANTED, Channel, Message, Recording, ros_name
from nscan_cli.logs.scan import LaserLog, Source


class InMemory:
    """As much of a path as the reader of rosbags asks for."""

    def __init__(self, data: bytes) -> None:
        self.data = data

    def exists(self) -> bool:
        """Whether there is something to read: always."""
        return True

    def open(self, _mode: str) -> io.BytesIO:
        """The bytes as a file."""
        return io.BytesIO(self.data)


def read(data: bytes, file: str, source: Source, options: ReadingOptions) -> LaserLog:
    """The scans of one topic; raises InputDataError and WrongUsageError as recorded.read does."""
    return recorded.read(recording(data, file, options.salvage), file, source, options)


def recording(data: bytes, file: str, salvage: bool) -> Recording:
    """All messages that are of use, in order of their log times. Raises InputDataError and ExceededError."""
    from lz4.frame import LZ4FrameDecompressor
    from rosbags.rosbag1 import Reader
    from rosbags.rosbag1.reader import decompressors

    recording = Recording("ROS 1 bag")
    path: Any = InMemory(data)
    opened = False
    try:
        with Reader(path) as bag:
            opened = True
            unpack = {
                name: _bounded(new, recording)
                for name, new in (("bz2", BZ2Decompressor), ("lz4", LZ4FrameDecompressor))
            }
            for at, chunk in bag.chunks.items():
                name = next((name for name in unpack if chunk.decompressor is decompressors[name]), None)
                if name is not None:
                    bag.chunks[at] = chunk._replace(decompressor=unpack[name])
            channels = {
                connection.id: Channel(
                    connection.topic,
                    ros_name(connection.msgtype),
                    "ros1",
                    "ros1msg",
                    connection.msgdef.data.encode(),
                )
                for connection in bag.connections
            }
            recording.counts = dict.fromkeys(channels.values(), 0)
            for connection in bag.connections:
                recording.counts[channels[connection.id]] += connection.msgcount
            wanted = [connection for connection in bag.connections if channels[connection.id].type in WANTED]
            for connection, time, message in bag.messages(wanted) if wanted else ():
                recording.keep(Message(channels[connection.id], time, message))
            promised: dict[int, int] = {}
            for info in bag.chunk_infos:
                for number, count in info.connection_counts.items():
                    promised[number] = promised.get(number, 0) + count
            for connection in bag.connections:
                if promised.get(connection.id, 0) != connection.msgcount:
                    raise ValueError(f"the index of {connection.topic} is not whole")
    except ExceededError:
        raise
    except Exception as error:
        # The format has no checksums: damage shows as any error that a parser can raise.
        problem = f"the bag is damaged or cut off ({' '.join(str(error).split()) or type(error).__name__})"
        if not salvage or not opened:
            remedy = "rebuild its index by `rosbag reindex`, or fetch it again"
            raise InputDataError(file, problem, remedy) from error
        recording.warnings.append(f"{problem}: the messages before it are used")
    return recording


def _bounded(new: Callable[[], Any], recording: Recording) -> Callable[[bytes], bytes]:
    """What unpacks a chunk, each once: chunks that overlap in time are asked for again and again.

    It raises ExceededError when they unpack to too much.
    """
    known: dict[bytes, bytes] = {}

    def unpacked(packed: bytes) -> bytes:
        content = known.get(packed)
        if content is None:
            content = new().decompress(packed, max_length=INPUT.bytes)
            recording.grow(len(content))
            known[packed] = content
        return content

    return unpacked
