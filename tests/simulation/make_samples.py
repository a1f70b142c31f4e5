"""Writes the sample logs: `python -m tests.simulation.make_samples FOLDER`. The same bytes every time."""

from __future__ import annotations

import gzip
import sys
from pathlib import Path

import numpy as np

from tests.simulation.drive import Drive
from tests.simulation.laser import Laser
from tests.simulation.office import office_way, office_world
from tests.simulation.other_forms import player, ros2_mcap, swept_mcap
from tests.simulation.scenes import corridor_and_room, office
from tests.simulation.sweeping import SweptRecording, Turning, fine_path, record_swept

SEEDS = {"office": 1, "corridor_and_room": 3, "turning_laser": 1}


def turning_laser() -> SweptRecording:
    """A small robot that turns quickly, and its laser five times a second, in a part of the office."""
    laser = Laser(180, -np.pi, np.radians(2), 8.0, noise=0.01, resolution=0.001, dropout=0.01)
    path = fine_path(office_way()[:7], Drive(speed=0.5, turn_rate=2.8))
    return record_swept("turning_laser", office_world(), path, laser, Turning(), SEEDS["turning_laser"])


def samples() -> dict[str, bytes]:
    """Every sample by its file's name: CARMEN text, and the small one in other forms as well."""
    small = corridor_and_room().record(SEEDS["corridor_and_room"])
    return {
        "office.log": office().record(SEEDS["office"]).carmen(),
        "corridor_and_room.log": small.carmen(),
        "corridor_and_room.player.log": player(small),
        "corridor_and_room.mcap": ros2_mcap(small),
        "turning_laser.mcap": swept_mcap(turning_laser()),
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
