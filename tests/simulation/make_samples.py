"""Writes the sample logs: `python -m tests.simulation.make_samples FOLDER`. The same bytes every time."""

from __future__ import annotations

import gzip
import sys
from pathlib import Path

from tests.simulation.other_forms import player, ros2_mcap
from tests.simulation.scenes import corridor_and_room, office

SEEDS = {"office": 1, "corridor_and_room": 3}


def samples() -> dict[str, bytes]:
    """Every sample by its file's name: CARMEN text, and the small one in other forms as well."""
    small = corridor_and_room().record(SEEDS["corridor_and_room"])
    return {
        "office.log": office().record(SEEDS["office"]).carmen(),
        "corridor_and_room.log": small.carmen(),
        "corridor_and_room.player.log": player(small),
        "corridor_and_room.mcap": ros2_mcap(small),
    }


def main(folder: str) -> None:
    """Write every sample into an existing folder, text compressed by gzip."""
    for name, content in samples().items():
        if name.endswith(".log"):
            # mtime 0: no clock in the bytes.
            Path(folder, f"{name}.gz").write_bytes(gzip.compress(content, compresslevel=9, mtime=0))
        else:
            Path(folder, name).write_bytes(content)


if __name__ == "__main__":
    main(sys.argv[1])
