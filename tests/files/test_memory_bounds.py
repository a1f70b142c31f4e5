"""Memory stays within the bound that docs/limits.md gives, and what needs more ends in one line."""

from __future__ import annotations

import re
import subprocess
import sys
import zlib
from pathlib import Path

import pytest

from nscan_cli.files.limits import MB
from tests.logs.lines import flaser

IN_BOUNDS = """
import resource, sys
from nscan_cli.cli.main import run
import nscan_cli.cli.info, nscan_cli.logs.load, nscan_cli.graph.io.load_graph, nscan_cli.logs.recordings.mcap
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
limit = used + int(sys.argv[1])
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
sys.exit(run(["info", sys.argv[2], "--allow-corrected"]))
"""


def in_bounds(path: Path, megabytes: float) -> subprocess.CompletedProcess[str]:
    """`info` on a file, with so much memory more than the start of the program takes."""
    command = [sys.executable, "-c", IN_BOUNDS, str(int(megabytes * MB)), str(path)]
    return subprocess.run(command, capture_output=True, text=True)


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="no /proc")
@pytest.mark.parametrize("kind", ["scans", "short lines", "tags"])
def test_reading_keeps_its_bound_of_memory(tmp_path, kind):
    """docs/limits.md: 8 MB for each MB of scans, 45 MB for each of anything; 64 MB besides."""
    text = {
        "scans": (flaser(1.0, tuple(1.0 + k / 1000 for k in range(180))) + "\n") * 3000,
        "short lines": "FLASER 1 1 0 0 0 0 0 0 1 h 1\n" * 70_000,
        "tags": flaser(1.0) + "\n" + "ABC\n" * 500_000,
    }[kind]
    path = tmp_path / "log"
    path.write_text(text)
    done = in_bounds(path, 64 + (8 if kind == "scans" else 45) * len(text) / MB)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="no /proc")
@pytest.mark.parametrize("megabytes", range(36, 44))
def test_what_needs_more_memory_than_there_is_ends_in_one_line(tmp_path, megabytes):
    """Whether the last allocation that fails is a large or a small one."""
    path = tmp_path / "log"
    path.write_text((flaser(1.0, (1.0,) * 180) + "\n") * 30_000)
    done = in_bounds(path, megabytes)
    assert (done.returncode, done.stdout) == (65, "")
    assert re.fullmatch("nscan-cli: .*memory.*\n", done.stderr)


def test_a_bomb_of_ten_gigabytes_takes_no_more_than_the_limit(tmp_path):
    """10 GB of zeros, packed member by member; refused at 8 MB."""
    packer = zlib.compressobj(9, zlib.DEFLATED, zlib.MAX_WBITS | 16)
    member = packer.compress(bytes(16 * MB)) + packer.flush()
    path = tmp_path / "bomb.gz"
    path.write_bytes(member * 640)
    assert path.stat().st_size < 12 * MB
    environment = {"NSCAN_CLI_MAX_INPUT_MB": "16"}
    command = [sys.executable, "-c", IN_BOUNDS, str(128 * MB), str(path)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 65
    assert "decompresses to too many bytes, more than the limit of 16 MB" in done.stderr
