"""ROS 1 bags: what may be missing in them, and how they may be packed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from nscan_cli.errors import InputDataError
from tests.logs.recordings.messages import check_drive, drive
from tests.logs.recordings.ros import bag1


@pytest.mark.parametrize("compression", ["BZ2", "LZ4"])
def test_packed_bags(read, tmp_path, compression):
    check_drive(read(bag1(drive(), tmp_path, compression)))


def with_index_at(data: bytes, index_at: int) -> bytes:
    """The bag with another place of the index in its header."""
    at = data.index(b"index_pos=") + len(b"index_pos=")
    return data[:at] + index_at.to_bytes(8, "little") + data[at + 8 :]


def index_of(data: bytes) -> int:
    """The byte where the index of a bag begins."""
    at = data.index(b"index_pos=") + len(b"index_pos=")
    return int.from_bytes(data[at : at + 8], "little")


NO_INDEX = (
    "the bag has no index, since its recorder did not close it: its messages were found by reading all of it"
)
WRONG_INDEX = "the index of the bag is wrong: its messages were found by reading all of it"


def check_walked(log, said: str) -> None:
    """The log is that of drive(), and the only warning begins so."""
    (warning,) = log.report.warnings
    assert warning.startswith(said)
    check_drive(replace(log, report=replace(log.report, warnings=())))


@pytest.mark.parametrize("compression", [None, "LZ4"])
def test_a_bag_without_index(read, tmp_path, compression):
    data = bag1(drive(), tmp_path, compression)
    check_walked(read(with_index_at(data, 0)), NO_INDEX)
    # A recorder that was killed has written none at all.
    check_walked(read(with_index_at(data, 0)[: index_of(data)]), NO_INDEX)


def test_a_bag_whose_last_chunk_was_never_closed(read, tmp_path):
    data = with_index_at(bag1(drive(), tmp_path), 0)
    # The size of the chunk is the last field of its header, and its data follow.
    at = data.index(b"size=") + len(b"size=")
    begin = at + 8
    end = begin + int.from_bytes(data[at + 4 : begin], "little")
    # As it was begun: lengths of 0, which closing it would have put right, and the records behind it.
    begun = data[:at] + bytes(4) + bytes(4) + data[begin:end]
    check_walked(read(begun), NO_INDEX)
    with pytest.raises(InputDataError, match=r"cut off at byte \d+ .*ends within a record.*--salvage"):
        read(begun[:-30])
    log = read(begun[:-30], salvage=True)
    assert len(log) >= 11
    assert "the undamaged part is used" in log.report.warnings[0]


@pytest.mark.parametrize("longer", [4, 2224, 10**6, 2**32 - 10**6])
def test_records_of_the_index_with_a_wrong_length(read, tmp_path, longer):
    data = bag1(drive(), tmp_path)
    at = data.index(b"\x04\0\0\0op=\4") - 4
    header = int.from_bytes(data[at : at + 4], "little")
    at += 4 + header
    length = (int.from_bytes(data[at : at + 4], "little") + longer) % 2**32
    check_walked(read(data[:at] + length.to_bytes(4, "little") + data[at + 4 :]), WRONG_INDEX)


def test_an_index_that_says_something_else(read, tmp_path):
    data = bag1(drive(), tmp_path)
    # The number of messages in the first entry of the chunk's record.
    at = data.index(b"op=\6", index_of(data))
    at = data.index((13).to_bytes(4, "little"), at)
    check_walked(read(data[:at] + b"\x0e" + data[at + 1 :]), WRONG_INDEX)
    check_walked(read(with_index_at(data, index_of(data) + 1)), WRONG_INDEX)


def test_a_bag_that_is_cut_off(read, tmp_path):
    data = bag1(drive(400), tmp_path)
    for size in (len(data) // 3, index_of(data) - 5):
        with pytest.raises(InputDataError, match=r"cut off at byte \d+ .*; .*--salvage"):
            read(data[:size])


def test_what_is_whole_of_a_bag_that_is_cut_off(read, tmp_path):
    chunks = bag1(drive(30, beams=12_000), tmp_path)
    log = read(chunks[: len(chunks) - 200_000], salvage=True)
    assert 15 < len(log) < 30
    assert any("cut off" in warning for warning in log.report.warnings)
    # Damage between chunks costs what is there, and not what follows.
    at = chunks.rindex(b"compression=none")
    between = chunks.rindex(b"op=\4", 0, at) - 20
    broken = chunks[:between] + b"\xff" * 12 + chunks[between + 12 :]
    assert len(read(broken, salvage=True)) == 30


def test_an_encrypted_bag(read, tmp_path):
    data = bag1(drive(), tmp_path)
    at = data.index(b"index_pos=") - 4
    field = b"encryptor=rosbag/AesCbcEncryptor"
    head = int.from_bytes(data[13:17], "little") + 4 + len(field)
    made = (
        data[:13]
        + head.to_bytes(4, "little")
        + data[17:at]
        + len(field).to_bytes(4, "little")
        + field
        + data[at:]
    )
    with pytest.raises(InputDataError, match="is encrypted, by rosbag/AesCbcEncryptor"):
        read(made)


def test_a_damaged_chunk_of_a_bag(read, tmp_path):
    data = bag1(drive(), tmp_path)
    # The first record of the chunk that holds the 5th scan: its header gets another field's name.
    at = data.rindex(b"op=\2", 0, data.rindex(b"laser"))
    at = data.rindex(b"op=", 0, at)
    broken = data[:at] + b"xx=" + data[at + 3 :]
    with pytest.raises(InputDataError, match="damaged or cut off"):
        read(broken)
    log = read(broken, salvage=True)
    assert 0 < len(log) < 12
    assert "the undamaged part is used" in log.report.warnings[0]
