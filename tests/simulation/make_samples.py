"""Writes the sample logs: `python -m tests.simulation.make_samples FOLDER`. The same bytes every time."""

from __future__ import annotations

import gzip
import sys
from pathlib import Path

from tests.simulation.scenes import corridor_and_room, office

SEEDS = {"office": 1, "corridor_and_room": 3}


def samples() -> dict[str, bytes]:
    """The CARMEN text of every sample log by its file's name."""
    return {
        f"{scene.name}.log": scene.record(SEEDS[scene.name]).carmen()
        for scene in (office(), corridor_and_room())
    }


def main(folder: str) -> None:
    """Write every sample, compressed, into an existing folder."""
    for name, text in samples().items():
        # mtime 0: no clock in the bytes.
        Path(folder, f"{name}.gz").write_bytes(gzip.compress(text, compresslevel=9, mtime=0))


if __name__ == "__main__":
    main(sys.argv[1])
