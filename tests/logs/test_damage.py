"""Files cut or changed at random places: an error in one line, a counted warning, or all that is readable.

Never a traceback, and never silently fewer scans: what is missing is told by an error, or by a warning.
"""

from __future__ import annotations

import gzip
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nscan_cli.errors import InputDataError
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.logs.forms import FORMS
from tests.logs.lines import flaser
from tests.logs.recordings.containers import repacked
from tests.logs.recordings.messages import drive
from tests.logs.recordings.ros import ros2

COUNT = 40
READINGS = [tuple(round(1 + 0.01 * k + 0.1 * beam, 2) for beam in range(20)) for k in range(COUNT)]
LINES = [flaser(100 + k, readings, (k, 0, 0)) for k, readings in enumerate(READINGS)]
CARMEN = "\n".join([*LINES, ""]).encode()


def place_said(error: InputDataError) -> None:
    text = str(error)
    assert ";" in text
    assert "\n" not in text


def changed(data: bytes, seed: int) -> Iterator[bytes]:
    """The data with one byte changed, at 100 random places."""
    chance = random.Random(seed)
    for _ in range(100):
        at = chance.randrange(len(data))
        yield data[:at] + bytes([data[at] ^ (1 << chance.randrange(8))]) + data[at + 1 :]


def cut(data: bytes, seed: int) -> Iterator[bytes]:
    """The data cut off at 25 random places."""
    chance = random.Random(seed)
    for _ in range(25):
        yield data[: chance.randrange(8, len(data))]


def outcome(path: Path, data: bytes, **options) -> LaserLog | None:
    """The log; None when the data are refused in the way of a user's mistake."""
    path.write_bytes(data)
    try:
        return read_log(str(path), ReadingOptions(**options))
    except InputDataError as error:
        place_said(error)
        return None


def some_told(log: LaserLog) -> bool:
    return bool(log.report.warnings or log.report.skipped)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "damaged"


@pytest.mark.parametrize("container", ["zstd", "data checksum", "not chunked"])
def test_mcap(path, container):
    options: dict[str, Any] = {
        "zstd": {},
        "data checksum": {"enable_data_crcs": True, "use_chunking": False},
        "not chunked": {"use_chunking": False},
    }[container]
    data = repacked(ros2(drive(COUNT)), **options)
    whole = outcome(path, data)
    assert whole is not None
    refused, used = 0, 0
    for seed, broken in enumerate([*changed(data, 1), *cut(data, 2)]):
        log = outcome(path, broken)
        refused += log is None
        if log is not None:
            assert len(log) == COUNT or some_told(log), seed
            if container != "not chunked":
                # A checksum covers every message: what passes is what was written.
                np.testing.assert_array_equal(log.ranges, whole.ranges)
        salvaged = outcome(path, broken, salvage=True)
        used += salvaged is not None
        if salvaged is not None:
            assert len(salvaged) == COUNT or some_told(salvaged), seed
            if log is None:
                assert salvaged.report.warnings, seed
    # Without checksums, what is changed within a message goes unnoticed; cut files never do.
    assert refused >= (25 if container == "not chunked" else 90)
    assert used > 60


@pytest.mark.parametrize("form", ["ROS 1 bag", "ROS 2 db3", "protobuf", "json", "rosbags mcap"])
def test_other_recordings(path, form, tmp_path):
    data = FORMS[form](drive(COUNT), tmp_path)
    for broken in [*list(changed(data, 3))[:40], *list(cut(data, 4))[:10]]:
        for salvage in (False, True):
            log = outcome(path, broken, salvage=salvage)
            assert log is None or len(log) == COUNT or some_told(log)


def test_gzip(path):
    data = gzip.compress(CARMEN, mtime=0)
    refused = 0
    for broken in [*changed(data, 5), *cut(data, 6)]:
        log = outcome(path, broken)
        refused += log is None
        # Only the header's time, name and system do not matter.
        assert log is None or len(log) == COUNT or some_told(log)
        salvaged = outcome(path, broken, salvage=True)
        assert salvaged is None or len(salvaged) == COUNT or some_told(salvaged)
    assert refused > 110


def test_salvaged_gzip_has_the_lines_before_its_end(path):
    data = gzip.compress(CARMEN, mtime=0)
    assert outcome(path, data[: len(data) // 2]) is None
    log = outcome(path, data[: len(data) // 2], salvage=True)
    assert log is not None
    assert 5 < len(log) < COUNT
    assert log.report.warnings[0] == "the gzip data end too early: the rest is lost"
    two = gzip.compress(CARMEN[:2000]) + gzip.compress(CARMEN[2000:])
    whole = outcome(path, two, salvage=True)
    assert whole is not None
    assert (len(whole), whole.report.warnings) == (COUNT, ())


@pytest.mark.parametrize("seed", [7, 8])
def test_text(path, seed):
    for broken in [*changed(CARMEN, seed), *cut(CARMEN, seed)]:
        log = outcome(path, broken)
        if log is not None:
            lines = sum(1 for line in broken.splitlines() if line.strip())
            lost = sum(count for count, _ in log.report.skipped.values())
            assert len(log) + lost == lines or some_told(log)
            assert log.ranges.shape[0] == len(log.times)
