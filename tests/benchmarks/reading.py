"""How long logs take to read, from bytes to scans with odometry and mounting."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from nscan_cli.logs.load import read_log
from nscan_cli.logs.recordings.mcap import MCAP_MAGIC
from tests.benchmarks.clock import Timing, best_of
from tests.data import find_data
from tests.logs.forms import FORMS
from tests.logs.recordings.containers import repacked
from tests.logs.recordings.messages import drive

SCANS, BEAMS = 10_000, 360


def timings() -> Iterator[Timing]:
    """One by one; the name says how many scans, from which the rate follows."""
    real = (("CARMEN, intel", "intel.log.gz", 13_631), ("MCAP, mit-csail", "mit-csail.ros2.mcap", 1_988))
    for name, file, scans in real:
        path = find_data(file)
        if path is not None:
            yield _timed(name, scans, path)
    with TemporaryDirectory() as folder:
        written = drive(SCANS, beams=BEAMS)
        for form in ("ros1", "ros2", "protobuf", "ROS 1 bag", "ROS 2 db3"):
            path = Path(folder, "recording")
            data = FORMS[form](written, Path(folder))
            # Chunks of the size that recorders write; the tests have smaller ones.
            path.write_bytes(repacked(data, chunk_size=1 << 20) if data.startswith(MCAP_MAGIC) else data)
            yield _timed(f"{form}, {BEAMS} beams", SCANS, path)


def _timed(name: str, scans: int, path: Path) -> Timing:
    return Timing(f"read {scans} scans: {name}", best_of(partial(read_log, str(path)), 3))
