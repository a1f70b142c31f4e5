"""What tests of recordings share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.logs.recordings.messages import Written
from tests.logs.recordings.ros import ros2


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., LaserLog]:
    """Reads the bytes of a recording, or messages written in the form ros2, with some reading options."""

    def read_it(written: list[Written] | bytes, even_unusable: bool = False, **options) -> LaserLog:
        path = tmp_path / "recording"
        path.write_bytes(written if isinstance(written, bytes) else ros2(written))
        return read_log(str(path), ReadingOptions(**options), even_unusable)

    return read_it
