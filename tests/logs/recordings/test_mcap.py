"""The container: chunks, indexes, checksums; what becomes of damage."""

from __future__ import annotations

import io

import numpy as np
import pytest
from mcap.reader import make_reader

from nscan_cli.errors import InputDataError
from tests.logs.recordings.containers import containers, repacked
from tests.logs.recordings.messages import Scan, check_drive, drive
from tests.logs.recordings.ros import ros2


@pytest.fixture(scope="module")
def whole() -> bytes:
    return ros2(drive())


def test_every_container_gives_the_same(whole, read):
    for name, data in containers(whole):
        log = read(data)
        check_drive(log)
        unchecked = name in ("not chunked", "no checksums")
        assert log.report.used["checksums"] == (
            "the file has none of its messages" if unchecked else "they fit"
        ), name


def chunk_starts(data: bytes) -> list[int]:
    summary = make_reader(io.BytesIO(data)).get_summary()
    assert summary is not None
    return [index.chunk_start_offset for index in summary.chunk_indexes]


def test_a_damaged_chunk(whole, read):
    starts = chunk_starts(whole)
    assert len(starts) > 2
    broken = bytearray(whole)
    broken[starts[1] + 200] ^= 0x10
    with pytest.raises(InputDataError, match=rf"at byte {starts[1]}: a chunk is damaged .*--salvage"):
        read(bytes(broken))
    log = read(bytes(broken), salvage=True)
    assert 0 < len(log) < 12
    complaints = [warning for warning in log.report.warnings if warning.startswith("damaged: ")]
    assert f"at byte {starts[1]}: a chunk" in complaints[0]
    assert any(f"{len(log)} of 12 messages on /scan are readable" in warning for warning in complaints)


def test_a_broken_record_length_is_passed_by_the_index(whole, read):
    starts = chunk_starts(whole)
    broken = bytearray(whole)
    broken[starts[0] + 5] ^= 0x40  # in the length of the first chunk
    with pytest.raises(InputDataError, match=rf"at byte {starts[0]}: "):
        read(bytes(broken))
    log = read(bytes(broken), salvage=True)
    # All chunks but the first are found by the summary.
    others = sum(1 for _, channel, message in make_reader(io.BytesIO(whole)).iter_messages(topics=["/scan"])
                 if message.log_time > first_chunk_end(whole))  # fmt: skip
    assert len(log) == others


def first_chunk_end(data: bytes) -> int:
    summary = make_reader(io.BytesIO(data)).get_summary()
    assert summary is not None
    return summary.chunk_indexes[0].message_end_time


def test_cut_off(whole, read):
    starts = chunk_starts(whole)
    for end in (starts[2] + 10, starts[2], len(whole) - 1, len(whole) - 30):
        with pytest.raises(InputDataError, match=r"ends too early.*--salvage"):
            read(whole[:end])
        log = read(whole[:end], salvage=True)
        assert any("ends too early" in warning for warning in log.report.warnings)
        assert len(log) == 12 if end > starts[-1] + 100 else 0 < len(log) < 12
    with pytest.raises(InputDataError, match="has no laser scans"):
        read(whole[: starts[0]], salvage=True)


def test_messages_that_are_missing_are_missed(read):
    # Without chunks or checksums, a message turned into metadata leaves no trace but in the statistics.
    data = repacked(ros2(drive()), use_chunking=False)
    scan = next(at for at in range(len(data)) if data[at : at + 1] == b"\x05" and is_scan(data, at))
    broken = data[:scan] + b"\x0c" + data[scan + 1 :]
    with pytest.raises(InputDataError, match="11 of 12 messages on /scan are readable"):
        read(broken)
    assert len(read(broken, salvage=True)) == 11


def is_scan(data: bytes, at: int) -> bool:
    length = int.from_bytes(data[at + 1 : at + 9], "little")
    return length < 500 and b"laser\0" in data[at : at + 60]


@pytest.mark.parametrize("data", [b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" * 2, b"\x89MCAP0\r\n" + bytes(100)])
def test_hardly_anything(read, data):
    for options in ({}, {"salvage": True}):
        with pytest.raises(InputDataError):
            read(data, **options)


def test_messages_that_cannot_be_decoded_are_counted(whole, read):
    from mcap.writer import Writer

    out = io.BytesIO()
    writer = Writer(out)
    writer.start()
    channels: dict[int, int] = {}
    number = 0
    for schema, channel, message in make_reader(io.BytesIO(whole)).iter_messages():
        assert schema is not None
        if channel.id not in channels:
            made = writer.register_schema(schema.name, schema.encoding, schema.data)
            channels[channel.id] = writer.register_channel(channel.topic, "cdr", made)
        data = message.data
        if channel.topic == "/scan":
            number += 1
            # Shorter than it says, of no CDR form that is known, and empty.
            data = {3: data[:-25], 6: b"\x00\x09" + data[2:], 7: b""}.get(number, data)
        writer.add_message(channels[channel.id], message.log_time, data, message.log_time)
    writer.finish()  # type: ignore[no-untyped-call]
    log = read(out.getvalue())
    assert log.report.skipped == {"/scan: cannot be decoded": (3, 3)}
    assert len(log) == 9
    with pytest.raises(InputDataError, match="message 3: /scan: cannot be decoded"):
        read(out.getvalue(), strict=True)


@pytest.mark.parametrize(
    ("name", "encoding", "form", "said"),
    [
        ("sensor_msgs/msg/LaserScan", "cdr", "ros2msg", "the definition of sensor_msgs/msg/LaserScan"),
        ("foxglove.LaserScan", "protobuf", "protobuf", "the definition of foxglove.LaserScan"),
        ("foxglove.LaserScan", "flatbuffer", "flatbuffer", "encoded in flatbuffer"),
        ("acme/msg/Scan", "cdr", "ros2msg", r"no laser scans, only /scan \(acme/msg/Scan\)"),
    ],
)
def test_what_is_not_known_is_named(read, name, encoding, form, said):
    from mcap.writer import Writer

    out = io.BytesIO()
    writer = Writer(out)
    writer.start()
    channel = writer.register_channel(
        "/scan", encoding, writer.register_schema(name, form, b"no definition {")
    )
    writer.add_message(channel, 1, b"\0\1\0\0", 1)
    writer.finish()  # type: ignore[no-untyped-call]
    with pytest.raises(InputDataError, match=said):
        read(out.getvalue())


def test_many_scans_keep_their_order(read):
    written = drive(300, beams=30)
    # The last beam always says 3 m.
    log = read(ros2(written), as_recorded=True)
    np.testing.assert_array_equal(
        log.ranges, [one.content.ranges for one in written if isinstance(one.content, Scan)]
    )
