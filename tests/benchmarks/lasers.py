"""Lasers of all kinds in simulated buildings: `python -m tests.benchmarks.lasers OUT.md [SEED ...]`.

What the real logs of the tests do not have: short ranges, few beams, much noise, fast robots, lasers that
turn while the robot does; and places where scans tell little. Each laser is driven through several buildings,
of the seeds that are given or of those below; what is mapped, with odometry and without, is compared with the
true poses.
"""

from __future__ import annotations

import dataclasses
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.evaluation.alignment import alignment
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, compose
from nscan_cli.slam.diagnostics.notices import notices
from nscan_cli.slam.mapped_drive import map_drive
from nscan_cli.slam.options import SlamOptions
from tests.benchmarks.laser_kinds import GOOD, HARD, KINDS, NARROW, NONE, ODOMETRY, TURNING, Kind, recorded
from tests.benchmarks.robustness import false_loops
from tests.experiments.output import table

BUILDINGS = (1, 2, 3, 4, 5, 6)
"""Seeds: no two have the same rooms."""
FEW = 3
"""Buildings of lasers that turn, and hard places of each kind."""
RIGHT = 0.3
"""m; a map with a greater root mean square error is wrong."""


@dataclass(frozen=True)
class Outcome:
    """What came of one drive."""

    kind: str
    odometry: str
    error: float
    """Root mean square (m) of the positions off the true ones."""
    false: int
    told: bool
    """Whether something is said of the map."""


def outcome(kind: Kind, seed: int, odometry: str) -> Outcome:
    """Map one drive, and compare it with the truth."""
    log, truth = recorded(kind, seed, odometry)
    if odometry == NONE:
        log = dataclasses.replace(log, odometry=None, odometry_path=None)
    checked = checked_file(log, ReadingOptions(), FileCheckOptions())
    drive = map_drive(checked.log, SlamOptions(), reading=checked.reading, has_findings=checked.has_findings)
    is_told = bool(checked.messages or drive.messages or notices(drive.state))
    poses = drive.graph.poses
    return Outcome(kind.name, odometry, rms(poses, truth), false_loops(drive.graph, truth), is_told)


def rms(poses: Array, truth: Array) -> float:
    """Root mean square (m) of how far positions of poses (S, 3), laid over the true ones, are off these."""
    off = compose(alignment(poses, truth).motion, poses) - truth
    return float(np.sqrt((off[:, :2] ** 2).sum(axis=1).mean()))


def document(outcomes: list[Outcome], buildings: Sequence[int]) -> str:
    """The tables as Markdown."""
    first = (
        f"Written by `make lasers`. Simulated drives of 300 m through the corridors of {len(buildings)} "
        f"buildings (`tests/simulation/building.py`), with {len(KINDS)} kinds of lasers and robots. "
        "Corridors are 2.2 m wide, with a pier or a door every few metres: hard for a laser that sees no "
        "farther than that. Errors are root mean square errors of all positions, after the best rigid "
        f"alignment. A map is wrong if its error is above {RIGHT} m. It is told if `slam` warns of "
        "anything. A loop is false if it is 0.5 m or 5° off. Ranges have a noise of 1.5 cm unless stated "
        "otherwise, and of 1 to 3 cm with the lasers that turn and those of 270° and 240°. Odometry is 1 % "
        "too long, veers by 0.05° a metre, and has noise."
    )
    swept = (
        "The same buildings; each beam is seen from where the robot is at its time. Odometry has its own "
        "stamps, 20 a second. The robot starts and stops turning at once."
    )
    hard = (
        "Places of `tests/simulation/places.py`. Bare corridors: their walls have only door frames, 4 cm "
        "deep. Warehouse: a hall of like aisles between racks. Grounds: four buildings, trees, hedges and "
        "parked cars; ways are driven in both directions, about a third of the beams do not return, and at "
        "times the laser looks down by a few degrees and sees the ground as a wall. Poor odometry is 10 % "
        "too long, veers by 5° a metre, and has more noise."
    )
    few = (
        "In a warehouse such lasers see the same in each aisle, and along bare corridors hardly any end of a "
        "wall: odometry has to lead. On the grounds most scans have less than ten points."
    )
    names = {GOOD: "With odometry", "poor": "With poor odometry", NONE: "Without odometry"}
    parts = ["# Lasers", first]
    for kinds, title, text in (
        (KINDS, "", ""),
        (TURNING, "Lasers that turn", swept),
        (HARD, "Hard places", hard),
        (NARROW, "Narrow and short views", few),
    ):
        parts += [f"## {title}", text] if title else []
        for odometry, name in names.items():
            found = [each for each in outcomes if each.odometry == odometry]
            rows = [row for kind in kinds if (row := _row(kind.name, found))]
            if rows:
                parts += [
                    f"{'###' if title else '##'} {title + ', ' + name.lower() if title else name}",
                    table(HEADER, rows),
                ]
    return "\n\n".join(parts) + "\n"


HEADER = ("laser", "median, m", "worst, m", "maps wrong", "of these not told", "false loops")


def _row(kind: str, outcomes: list[Outcome]) -> tuple[str, ...]:
    """That of one kind; empty if it was not driven."""
    found = [each for each in outcomes if each.kind == kind]
    if not found:
        return ()
    error = np.array([each.error for each in found])
    wrong = [each for each in found if each.error > RIGHT]
    return (
        kind,
        f"{np.median(error):.3f}",
        f"{error.max():.3f}",
        f"{len(wrong)} of {len(found)}",
        f"{sum(not each.told for each in wrong)}",
        f"{sum(each.false for each in found)}",
    )


def drives(buildings: Sequence[int]) -> list[tuple[Kind, int, str]]:
    """All that are mapped."""
    few = buildings[:FEW]
    return [
        *((kind, seed, odometry) for kind in KINDS for odometry in (GOOD, NONE) for seed in buildings),
        *((kind, seed, odometry) for kind in TURNING for odometry in (GOOD, NONE) for seed in few),
        *((kind, seed, odometry) for kind in (*HARD, *NARROW) for odometry in ODOMETRY for seed in few),
    ]


def main(out: str, buildings: Sequence[int]) -> None:
    """Map all drives in two processes; write the document."""
    outcomes = []
    with ProcessPoolExecutor(2) as pool:
        for each in [pool.submit(outcome, *each) for each in drives(buildings)]:
            outcomes.append(each.result())
            print(outcomes[-1], flush=True)
    Path(out).write_text(document(outcomes, buildings), encoding="utf-8")


if __name__ == "__main__":
    # One thread a process, as the command line does it.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    main(sys.argv[1], [int(seed) for seed in sys.argv[2:]] or BUILDINGS)
