"""What is damaged: a small sound sample or two of every form that is read."""

from __future__ import annotations

import bz2
import gzip
import lzma
import tempfile
from pathlib import Path

import lz4.frame
import zstandard

from nscan_cli.graph.io.g2o import write_g2o
from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.graph.io.tum import write_tum
from tests.cli.room_logs import room_log
from tests.data import find_data
from tests.graph.small_graph import small_graph
from tests.logs.forms import FORMS
from tests.logs.recordings.containers import repacked
from tests.logs.recordings.messages import drive
from tests.logs.test_radish_forms import FORMS as WITH_BEARINGS
from tests.logs.text.test_player import V1, V2
from tests.logs.text.test_script_format import LINES

REAL_LINES = 60
"""Of the real logs, so many lines."""
RELATION = "100.0 100.2 0.1 0.0 0.0 0.0 0.0 0.01\n"
CONFIG = b"""\
min-range = 0.2
mount = [0.1, 0.0, 90]
[info]
every = 2
laser = "FLASER"
[slam]
max-scans = 5
relations = "both"
"""
MANIFEST = b"""\
[[log]]
name = "intel"
path = "intel.log.gz"
relations = "intel.relations"
max_translation = 0.02
published = { "Cartographer" = 0.0229, "RBPF" = 0.070 }
[log.parameters]
end = 60
[[log]]
name = "other"
path = "other.mcap"
"""


OTHER_G2O = f"""\
VERTEX2 x0 0 0 0
VERTEX_SE3:QUAT {(120 << 56) + 1} 1 0 0 0 0 0.5 0.8660254
EDGE2 x0 x1 1 0 1.047 100 100 100 400 0 0
EDGE_SE3:QUAT x1 x0 -0.5 0.866 0 0 0 -0.5 0.8660254 9 0 0 0 0 0 9 0 0 0 0 9 0 0 0 9 0 0 9 0 9
VERTEX_XY 5000 1 2
EDGE_SE2_XY x0 5000 1 2 10 0 10
EDGE_PRIOR_SE2 x0 0 0 0 1000 0 0 1000 0 1000
FIX x0
"""


def samples() -> dict[str, list[bytes]]:
    """The samples of each form, by its name; what the real logs add where they are there."""
    carmen = [room_log(12).encode(), *_real("fr079.log.gz"), *_real("mit-csail.log.gz")]
    players = [V1, V2, *(lines for lines, _ in WITH_BEARINGS.values())]
    graph = write_graph(small_graph())
    found = {
        "carmen": carmen,
        "player": ["\n".join(lines).encode() + b"\n" for lines in players],
        "script": ["\n".join(LINES * 3).encode()],
        "gzip": [gzip.compress(data, mtime=0) for data in carmen[:2]],
        "packed": [
            bz2.compress(carmen[0]),
            lzma.compress(carmen[0]),
            zstandard.compress(carmen[0]),
            lz4.frame.compress(carmen[0]),
        ],
        "json graph": [graph],
        "g2o": [write_g2o(small_graph()), OTHER_G2O.encode()],
        "tum": [write_tum([f"{100 + 0.2 * k:.1f}" for k in range(3)], small_graph().poses)],
        "relations": [RELATION.encode() * 3],
        "config": [CONFIG],
        "manifest": [MANIFEST],
    }
    with tempfile.TemporaryDirectory() as folder:
        for name, write in FORMS.items():
            data = write(drive(6), Path(folder))
            bare = "bag" in name or "db3" in name
            # Without checksums, what is damaged inside reaches the decoders.
            loose = [] if bare else [repacked(data, use_chunking=False, enable_crcs=False)]
            found[f"recording, {name}"] = [data, *loose]
    return found


def _real(name: str) -> list[bytes]:
    path = find_data(name)
    if path is None:
        return []
    with gzip.open(path) as file:
        return [b"".join(file.readline() for _ in range(REAL_LINES))]
