"""What is given as a log: packed or not, a path or standard input, and all that is no log."""

from __future__ import annotations

import contextlib
import gzip
import hashlib
import io
import os
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from nscan_cli.errors import InputDataError, InputMissingError, NscanError, WrongUsageError
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.logs.lines import flaser

TEXT = "\n".join(flaser(time, laser=(time, 0, 0)) for time in range(20)).encode() + b"\n"


def test_plain_packed_and_standard_input_give_the_same(tmp_path, monkeypatch):
    (tmp_path / "plain").write_bytes(TEXT)
    packed = gzip.compress(TEXT[:700]) + gzip.compress(TEXT[700:])
    (tmp_path / "packed").write_bytes(packed)
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(packed)))
    logs = [read_log(str(tmp_path / "plain")), read_log(str(tmp_path / "packed")), read_log("-")]
    for log in logs:
        np.testing.assert_array_equal(log.ranges, logs[0].ranges)
        assert log.stamps == logs[0].stamps
    assert [log.source.name for log in logs] == ["plain", "packed", "standard input"]
    # The source is the bytes as they are stored.
    assert logs[0].source.sha256 == hashlib.sha256(TEXT).hexdigest()
    assert logs[1].source.sha256 == logs[2].source.sha256 == hashlib.sha256(packed).hexdigest()
    assert logs[1].source.bytes == len(packed)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "is empty"),
        (b" \n\n", "is empty"),
        (gzip.compress(b"", mtime=0), "is empty"),
        (gzip.compress(TEXT, mtime=0)[:-20], "end too early"),
        (gzip.compress(TEXT, mtime=0)[:60] + b"\xff" * 40, "damaged"),
        (gzip.compress(gzip.compress(TEXT, mtime=0), mtime=0), "gzip twice"),
        (b"#ROSBAG V1.2\n", "a ROS 1 bag of an old version"),
        (b"#ROSBAG V2.0\n", "the bag is damaged or cut off"),
        (b"SQLite format 3\0.....", "the database is damaged"),
        (b"\x89PNG\r\n\x1a\n....", "a PNG picture"),
        (b"# logs\n[[log]]\nname = 1\n", "TOML or INI text"),
        (b"[slam]\n", "TOML or INI text"),
        (b"[[1, 2]]\n", "JSON text"),
        (b'{"format": "nscan-pose-graph"}', "a pose graph"),
        (b'{"format":"nscan-pose-graph",\n"version":"1.0"}', "a pose graph"),
        (b'{"name": "a"}', "JSON text"),
        (b"# graph\nVERTEX_SE2 0 0 0 0\n", "a pose graph"),
        (b"1134864629.895182 0.1 0 0 0 0 0 1\n", "eight numbers per line"),
        (b"position 0 1014.5 1.0 2.0 0.5 0 0 0\n", "has no laser scans, only position:0"),
        (b"@OPEN 1-2-3\n@SENS 01-01-99 10:00:00.1\n", "a BeeSoft .rec log"),
        (b"LASER_READING 180 1.0\n", "GMapping .gfs"),
        (b"image: a.pgm\n", "YAML"),
        (b"Dear all,\n", "unknown kind"),
        (b"\0\1\2\3" * 100, "binary data"),
        (b"a.log" + bytes(252) + b"ustar" + bytes(250) + TEXT, "a tar archive"),
    ],
)
def test_what_is_no_log_is_named(tmp_path, data, said):
    path = tmp_path / "x.log"
    path.write_bytes(data)
    with pytest.raises(InputDataError, match=said) as caught:
        read_log(str(path))
    assert str(caught.value).startswith(f"{path}: ")
    assert ";" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_cannot_be_read(tmp_path):
    for path, said in ((tmp_path, "folder"), (tmp_path / "none", "no such file"), ("a\0b", "cannot be read")):
        with pytest.raises(InputMissingError, match=said):
            read_log(str(path))


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_what_may_not_be_read(tmp_path):
    path = tmp_path / "a.log"
    path.write_bytes(TEXT)
    path.chmod(0)
    with pytest.raises(InputMissingError, match=r"a\.log"):
        read_log(str(path))


@pytest.mark.parametrize(
    "wrong",
    [
        {"max_range": float("nan")},
        {"angle_min": float("inf")},
        {"mount": (0.0, float("nan"), 0.0)},
        {"min_range": 5.0, "max_range": 5.0},
        {"angle_increment": 0.0},
        {"start": 5.0, "end": 4.0},
    ],
)
def test_options_that_no_log_fits(wrong):
    with pytest.raises(WrongUsageError):
        ReadingOptions(**wrong)


def readable(path, data: bytes) -> None:
    """The data are read, or refused in the way of a user's mistake; nothing else."""
    path.write_bytes(data)
    for options in (ReadingOptions(), ReadingOptions(strict=True), ReadingOptions(laser="RAWLASER1")):
        with contextlib.suppress(NscanError):
            check(read_log(str(path), options))


def check(log: LaserLog) -> None:
    """What holds for every log that is read."""
    assert log.ranges.shape[0] == len(log.times) == len(log.stamps) == len(log.numbers)
    assert (np.diff(log.times) >= 0).all()
    assert np.isfinite(log.mount).all()
    assert log.odometry is None or np.isfinite(log.odometry).all()
    assert not (log.ranges <= 0).any()


FUZZ = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@FUZZ
@given(st.binary(max_size=400))
def test_random_bytes(tmp_path, data):
    readable(tmp_path / "random", data)
    readable(tmp_path / "random", TEXT + data + TEXT)


TOKENS = st.sampled_from(
    ["FLASER", "RLASER", "RAWLASER1", "ROBOTLASER1", "ODOM", "PARAM", "TRUEPOS", "LASER3", "NEFF", "#", "\n",
     "0", "1", "2", "3", "-1", "1e308", "-1e308", "nan", "inf", "1e-300", "81.91", "0.5", "9999999999",
     "x", "1.2.3", "robot_frontlaser_offset", "robot_front_laser_max", "\t", "", "\r", "\x00", "é", "1_0"]
)  # fmt: skip


@FUZZ
@given(st.lists(st.tuples(st.integers(0, 2**16), TOKENS, st.booleans()), min_size=1, max_size=12))
@example([(0, "FLASER", True), (0, "FLASER", True), (0, "FLASER", True), (43, "1e-300", False)])
def test_mutated_lines(tmp_path, changes):
    lines = [
        "PARAM robot_frontlaser_offset 0.1 nohost 0",
        "ROBOTLASER1 0 -0.5 1.0 0.5 5.0 0.01 0 3 1 2 6 2 7 8 0.7 0 3.1 1 0 0 0.1 0 1 1 1e6 1 h 0",
        "RAWLASER1 0 -1.5 3.0 0.5 20 0 0 2 1 2 0 11.0 h 0",
        "ODOM 0 0 1 0 0 0 10.0 h 0",
        "TRUEPOS 5 6 0.5 0 0 0 2.0 h 0",
        *(flaser(time, laser=(time, 0, 0)) for time in range(4)),
    ]
    tokens = "\n".join(lines).replace("\n", " \n ").split(" ")
    for at, token, insert in changes:
        if insert:
            tokens.insert(at % len(tokens), token)
        else:
            tokens[at % len(tokens)] = token
    readable(tmp_path / "mutated", " ".join(tokens).encode())
