"""Lasers of all kinds in simulated buildings: `python -m tests.benchmarks.lasers OUT.md [SEED ...]`.

What the real logs of the tests do not have: short ranges, few beams, much noise, fast robots. Each laser is
driven through several buildings, of the seeds that are given or of those below; what is mapped, with odometry
and without, is compared with the true poses.
"""

from __future__ import annotations

import dataclasses
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from nscan_cli.evaluation.alignment import alignment
from nscan_cli.poses import Array, compose
from nscan_cli.slam.diagnostics.notices import notices
from nscan_cli.slam.options import SlamOptions
from nscan_cli.slam.pipeline import run_slam
from nscan_cli.slam.state import SlamState
from tests.benchmarks.robustness import false_loops
from tests.experiments.output import table
from tests.simulation.building import building, drive
from tests.simulation.drive import Drive
from tests.simulation.laser import Laser

BUILDINGS = (1, 2, 3, 4, 5, 6)
"""Seeds: no two have the same rooms."""
WAY = [(0, 0), (2, 0), (2, 2), (0, 2), (0, 1), (1, 1), (1, 0), (0, 0), (0, 1), (2, 1), (2, 0), (1, 0), (1, 2)]
"""Crossings of corridors, 300 m of way; the robot comes back to most corridors, also from their other end."""
RIGHT = 0.3
"""m; a map with a greater root mean square error is wrong."""


@dataclass(frozen=True)
class Kind:
    """A laser on a robot."""

    name: str
    laser: Laser
    how: Drive = field(default_factory=Drive)


@dataclass(frozen=True)
class Outcome:
    """What came of one drive."""

    kind: str
    odometry: bool
    error: float
    """Root mean square (m) of the positions off the true ones."""
    false: int
    told: bool
    """Whether something is said of the map."""


def turning(beams: int, reach: float, noise: float, dropout: float) -> Laser:
    """A laser that turns, and sees all around."""
    step = 2 * np.pi / beams
    return Laser(beams, -np.pi, step, reach, noise=noise, resolution=0.001, dropout=dropout)


KINDS = (
    Kind("180 beams, 30 m, as the samples have it", Laser()),
    Kind("the same, 5 cm of noise", Laser(noise=0.05)),
    Kind("the same, looking back from 0.3 m behind", Laser(mount=(-0.3, 0.1, np.pi))),
    Kind("the same, 2 m/s, a scan every 0.4 m", Laser(), Drive(speed=2.0, turn_rate=1.5)),
    Kind("91 beams, 20 m", Laser(91, -np.pi / 2, np.radians(2), 20.0)),
    Kind(
        "1081 beams over 270°, 30 m, 10 Hz",
        Laser(1081, -np.radians(135), np.radians(0.25), noise=0.01, resolution=0.001),
        Drive(period=0.1, speed=0.7),
    ),
    Kind("720 beams around, 12 m", turning(720, 12.0, 0.02, 0.03), Drive(period=0.1, speed=1.0)),
    Kind("360 beams around, 6 m", turning(360, 6.0, 0.03, 0.05), Drive(period=0.18)),
    Kind("360 beams around, 3.5 m, 0.22 m/s", turning(360, 3.5, 0.03, 0.05), Drive(speed=0.22)),
    Kind(
        "682 beams over 240°, 4 m",
        Laser(682, -np.radians(120), np.radians(240) / 681, 4.0, noise=0.03, resolution=0.001, dropout=0.01),
        Drive(period=0.1),
    ),
)


def outcome(kind: Kind, seed: int, odometry: bool) -> Outcome:
    """Map one drive, and compare it with the truth."""
    place = building(2, 2, seed)
    recording = drive(place, place.crossings(WAY), "building", None, kind.laser, kind.how, seed)
    log = recording.log()
    state = SlamState.of_log(log if odometry else dataclasses.replace(log, odometry=None), SlamOptions())
    graph = run_slam(state, lambda scans, keyframes: None)
    false = false_loops(graph, recording.truth)
    return Outcome(kind.name, odometry, rms(graph.poses, recording.truth), false, bool(notices(state)))


def rms(poses: Array, truth: Array) -> float:
    """Root mean square (m) of how far positions of poses (S, 3), laid over the true ones, are off these."""
    off = compose(alignment(poses, truth).motion, poses) - truth
    return float(np.sqrt((off[:, :2] ** 2).sum(axis=1).mean()))


def document(outcomes: list[Outcome], buildings: Sequence[int]) -> str:
    """The tables as Markdown."""
    header = ("laser", "median, m", "worst, m", "maps wrong", "of these not told", "false loops")
    parts = [
        "# Lasers",
        f"Written by `make lasers`: simulated drives of 300 m through the corridors of {len(buildings)} "
        f"buildings (`tests/simulation/building.py`), {len(KINDS)} kinds of lasers and robots. "
        "Corridors are 2.2 m wide, with a pier or a door every few metres: hard for a laser that sees no "
        "farther than that. Root mean square errors of the positions, over all scans, after the best rigid "
        f"alignment. A map is wrong when that is above {RIGHT} m; it is told when `slam` says anything of "
        "it. A loop is false when it is 0.5 m or 5° off. Ranges have noise of 1.5 cm where nothing else is "
        "said, of 1 to 3 cm with the lasers that turn and those of 270° and 240°. Odometry is 1 % too long, "
        "veers by 0.05° a metre, and has noise.",
    ]
    for odometry, title in ((True, "With odometry"), (False, "Without odometry")):
        rows = []
        for kind in KINDS:
            found = [each for each in outcomes if (each.kind, each.odometry) == (kind.name, odometry)]
            error = np.array([each.error for each in found])
            wrong = [each for each in found if each.error > RIGHT]
            rows.append((
                kind.name,
                f"{np.median(error):.3f}",
                f"{error.max():.3f}",
                f"{len(wrong)} of {len(found)}",
                f"{sum(not each.told for each in wrong)}",
                f"{sum(each.false for each in found)}",
            ))  # fmt: skip
        parts += [f"## {title}", table(header, rows)]
    return "\n\n".join(parts) + "\n"


def main(out: str, buildings: Sequence[int]) -> None:
    """Map all drives in two processes; write the document."""
    outcomes = []
    with ProcessPoolExecutor(2) as pool:
        pending = [
            pool.submit(outcome, kind, seed, odometry)
            for kind in KINDS
            for odometry in (True, False)
            for seed in buildings
        ]
        for each in pending:
            outcomes.append(each.result())
            print(outcomes[-1], flush=True)
    Path(out).write_text(document(outcomes, buildings), encoding="utf-8")


if __name__ == "__main__":
    # One thread a process, as the command line does it.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    main(sys.argv[1], [int(seed) for seed in sys.argv[2:]] or BUILDINGS)
