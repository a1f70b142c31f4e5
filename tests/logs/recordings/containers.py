"""MCAP in containers of every kind."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from typing import Any

from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType
from mcap.writer import Writer as McapWriter


def repacked(data: bytes, schemas: Mapping[str, tuple[str, bytes]] | None = None, **options: Any) -> bytes:
    """The same messages in another container, by McapWriter's options such as use_chunking=False.

    `schemas` gives some types another definition, with its encoding.
    """
    out = io.BytesIO()
    writer = McapWriter(out, **({"chunk_size": 2000} | options))
    writer.start(profile="ros2")
    channels: dict[int, int] = {}
    for schema, channel, message in make_reader(io.BytesIO(data)).iter_messages(log_time_order=False):
        if channel.id not in channels:
            assert schema is not None
            encoding, text = (schemas or {}).get(schema.name, (schema.encoding, schema.data))
            number = writer.register_schema(schema.name, encoding, text)
            channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, number)
        writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time)
    writer.finish()  # type: ignore[no-untyped-call]
    return out.getvalue()


def containers(data: bytes) -> Iterator[tuple[str, bytes]]:
    """One recording in containers of every kind."""
    for compression in CompressionType:
        yield f"chunks, {compression.name}", repacked(data, compression=compression)
    yield "not chunked", repacked(data, use_chunking=False)
    yield "data section with a checksum", repacked(data, enable_data_crcs=True)
    yield "no checksums", repacked(data, enable_crcs=False)
    yield "no index", repacked(data, index_types=IndexType.NONE)
    bare: dict[str, Any] = {
        "use_statistics": False,
        "use_summary_offsets": False,
        "repeat_channels": False,
        "repeat_schemas": False,
    }
    yield "no summary", repacked(data, index_types=IndexType.NONE, **bare)
