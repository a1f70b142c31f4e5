"""Files that are compressed whole, and messages that are."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import lz4.frame
import pytest
import zstandard

from nscan_cli.errors import InputDataError
from nscan_cli.files import limits
from nscan_cli.files.limits import MB
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.logs.forms import FORMS
from tests.logs.lines import flaser
from tests.logs.recordings.messages import check_drive, drive
from tests.logs.recordings.ros import bag2

TEXT = "\n".join(flaser(1.0 + k, tuple(1.0 + i / 7 + k / 31 for i in range(180))) for k in range(60)).encode()
PACKERS: dict[str, Callable[[bytes], bytes]] = {
    "gzip": gzip.compress,
    "bzip2": bz2.compress,
    "xz": lzma.compress,
    "zstd": zstandard.compress,
    "lz4": lz4.frame.compress,
}
SALVAGE = ReadingOptions(salvage=True)


@pytest.fixture(params=PACKERS)
def pack(request) -> Callable[[bytes], bytes]:
    return PACKERS[request.param]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "packed"


def test_texts_and_recordings(pack, path, tmp_path, monkeypatch):
    path.write_bytes(pack(TEXT[:5000]) + pack(TEXT[5000:]))
    log = read_log(str(path))
    assert (len(log), log.report.warnings) == (60, read_plain(path).report.warnings)
    for form in ("ros2", "ROS 1 bag", "ROS 2 db3"):
        data = pack(FORMS[form](drive(), tmp_path))
        path.write_bytes(data)
        check_drive(read_log(str(path)))
        monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(data)))
        check_drive(read_log("-"))


def read_plain(path: Path) -> LaserLog:
    plain = path.with_name("plain")
    plain.write_bytes(TEXT)
    return read_log(str(plain))


def test_data_that_end_too_early(pack, path):
    data = pack(TEXT)
    path.write_bytes(data[: len(data) * 2 // 3])
    with pytest.raises(InputDataError, match=r"data end too early; .*--salvage"):
        read_log(str(path))
    if pack not in (bz2.compress, zstandard.compress):
        # These have too much of it in one block.
        log = read_log(str(path), SALVAGE)
        assert 5 < len(log) < 60
        assert "data end too early: the rest is lost" in log.report.warnings[0]


def test_data_that_are_damaged(pack, path):
    data = bytearray(pack(TEXT))
    data[len(data) // 2 : len(data) // 2 + 60] = b"\xff" * 60
    path.write_bytes(data)
    with pytest.raises(
        InputDataError, match=r"data are damaged near byte|data end too early|is none|skipped"
    ):
        read_log(str(path), ReadingOptions(strict=True))


def test_bytes_behind_the_data(pack, path):
    path.write_bytes(pack(TEXT) + bytes(100))
    assert len(read_log(str(path))) == 60
    path.write_bytes(pack(TEXT) + b"and more")
    with pytest.raises(InputDataError, match=r"8 bytes after the .* data are something else"):
        read_log(str(path))
    assert len(read_log(str(path), SALVAGE)) == 60


@pytest.mark.parametrize("options", [ReadingOptions(), SALVAGE], ids=["whole", "salvage"])
def test_bombs_are_refused(pack, path, monkeypatch, options):
    monkeypatch.setenv(limits.INPUT.variable, "2")
    path.write_bytes(pack(bytes(40 * MB)))
    with pytest.raises(
        InputDataError,
        match=r"decompresses to too many bytes, more than the limit of 2 MB|Memory usage limit",
    ):
        read_log(str(path), options)


def test_twice(pack, path):
    path.write_bytes(pack(pack(TEXT)))
    with pytest.raises(
        InputDataError, match=r"twice; decompress it once, by `(gunzip|bunzip2|unxz|unzstd|unlz4)`"
    ):
        read_log(str(path))


@pytest.mark.parametrize("plugin", ["MCAP", "SQLITE3"])
def test_messages_that_are_compressed_one_by_one(tmp_path, plugin, monkeypatch):
    folder = bag2(drive(), tmp_path / "my_bag", plugin, "MESSAGE")
    (path,) = (one for one in folder.iterdir() if one.suffix != ".yaml")
    data = path.read_bytes()
    assert data.count(b"\x28\xb5\x2f\xfd") >= 26
    check_drive(read_log(str(path)))
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(data)))
    check_drive(read_log("-"))


def test_a_compressed_message_that_is_damaged_is_skipped(tmp_path, read):
    folder = bag2(drive(), tmp_path / "my_bag", "SQLITE3", "MESSAGE")
    data = next(folder.glob("*.db3")).read_bytes()
    # The last scan: what follows the first bytes of its frame.
    at = data.index(b"\x28\xb5\x2f\xfd", data.index(b"\x28\xb5\x2f\xfd") + 4)
    log = read(data[: at + 4] + b"\xff" + data[at + 5 :])
    assert log.report.skipped
    assert all("cannot be decoded" in reason for reason in log.report.skipped)


def test_a_message_that_unpacks_to_too_much(tmp_path, monkeypatch):
    folder = bag2(drive(3, beams=16_000), tmp_path / "my_bag", "SQLITE3", "MESSAGE")
    path = next(folder.glob("*.db3"))
    assert len(read_log(str(path))) == 3
    monkeypatch.setenv(limits.INPUT.variable, str(path.stat().st_size / MB * 1.01))
    if path.stat().st_size < 3 * 64_000:
        with pytest.raises(InputDataError, match="decompresses to too many bytes"):
            read_log(str(path))


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"#ROSRECORD V1.2\n0123", r"a ROS 1 bag of an old version; .*`rosbag filter"),
        (
            b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 5\n",
            r"a Git LFS pointer.*`git lfs pull`",
        ),
        (b"\x97CObservation2DRangeScan\x06" + bytes(99), r"an MRPT \.rawlog; "),
        (b"\x91CActionCollection\x00" + bytes(99), r"an MRPT \.rawlog; "),
        (b"\xa2mrpt::obs::CObservation2DRangeScan\x06" + bytes(99), r"an MRPT \.rawlog; "),
        (b"7z\xbc\xaf\x27\x1c" + bytes(99), "a 7z archive; .*`7z x`"),
        (b"PK\x03\x04" + bytes(99), "a ZIP archive; .*`unzip`"),
        (b"\xd4\xc3\xb2\xa1" + bytes(99), "a capture of network packets"),
        (b"# .PCD v0.7 - Point Cloud Data\n", "a point cloud"),
    ],
)
def test_what_is_no_log_is_named_with_a_remedy(pack, path, data, said):
    path.write_bytes(data)
    with pytest.raises(InputDataError, match=f"is {said}"):
        read_log(str(path))
    # MRPT packs its own by gzip, as a rule.
    path.write_bytes(pack(data))
    with pytest.raises(InputDataError, match=f"is {said}"):
        read_log(str(path))
