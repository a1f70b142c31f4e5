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
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.evaluation.alignment import alignment
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, compose
from nscan_cli.slam.diagnostics.notices import notices
from nscan_cli.slam.mapped_drive import map_drive
from nscan_cli.slam.options import SlamOptions
from tests.benchmarks.robustness import false_loops
from tests.experiments.output import table
from tests.simulation.building import building, drive
from tests.simulation.drive import Drive, Odometry
from tests.simulation.laser import Laser
from tests.simulation.places import Place, bare_corridors, drive_through, grounds, warehouse
from tests.simulation.sweeping import Turning, fine_path, record_swept

BUILDINGS = (1, 2, 3, 4, 5, 6)
"""Seeds: no two have the same rooms."""
FEW = 3
"""Buildings of lasers that turn, and hard places of each kind."""
WAY = [(0, 0), (2, 0), (2, 2), (0, 2), (0, 1), (1, 1), (1, 0), (0, 0), (0, 1), (2, 1), (2, 0), (1, 0), (1, 2)]
"""Crossings of corridors, 300 m of way; the robot comes back to most corridors, also from their other end."""
RIGHT = 0.3
"""m; a map with a greater root mean square error is wrong."""
GOOD, NONE = "good", "none"
ODOMETRY = {
    GOOD: Odometry(),
    "poor": Odometry(0.03, np.radians(1.0), np.radians(2.0), scale=1.1, veer=np.radians(5.0)),
    NONE: Odometry(),
}
"""The errors of odometry; that of the last is not used."""


@dataclass(frozen=True)
class Kind:
    """A laser on a robot."""

    name: str
    laser: Laser
    how: Drive = field(default_factory=Drive)
    turning: Turning | None = None
    """None: a laser that sees at once."""
    place: Callable[[int], Place] | None = None
    """By the seed; None: a building."""


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


def turns(hertz: int, rate: float) -> Kind:
    """A laser that turns so often a second, on a robot that turns at a rate (rad/s)."""
    laser, period = (
        {5: turning(360, 8.0, 0.015, 0.03), 10: turning(720, 12.0, 0.015, 0.03)}[hertz],
        1.0 / hertz,
    )
    name = f"{laser.beams} beams around, {laser.max_range:.0f} m, {hertz} Hz, robot turns at {rate} rad/s"
    return Kind(name, laser, Drive(speed=0.5, turn_rate=rate), Turning(period, period))


TURNING = tuple(turns(hertz, rate) for hertz in (5, 10) for rate in (0.5, 1.5, 2.8))
HARD = (
    Kind(
        "bare corridors: 726 beams over 255°, 5.6 m, 10 Hz, 0.2 m/s",
        Laser(
            726, -np.radians(127.5), np.radians(255) / 725, 5.6, noise=0.02, resolution=0.001, dropout=0.01
        ),
        Drive(0.2, 0.6, 0.1),
        place=bare_corridors,
    ),
    Kind(
        "warehouse: 541 beams over 270°, 20 m, 10 Hz, 0.8 m/s",
        Laser(541, -np.radians(135), np.radians(0.5), 20.0, noise=0.02, resolution=0.001),
        Drive(0.8, 1.0, 0.1),
        place=warehouse,
    ),
    Kind(
        "grounds: 181 beams, 50 m, a scan every 0.2 m",
        Laser(181, max_range=50.0, noise=0.02, dropout=0.02),
        Drive(1.0, 0.7),
        place=grounds,
    ),
)


def narrow(beams: int, degrees: float, reach: float) -> Laser:
    """A laser that looks ahead, over so many degrees."""
    view = np.radians(degrees)
    return Laser(beams, -view / 2, view / (beams - 1), reach, noise=0.02, resolution=0.001)


NARROW = (
    Kind(
        "warehouse: 181 beams over 90°, 20 m, 0.8 m/s",
        narrow(181, 90, 20.0),
        Drive(0.8, 0.8, 0.1),
        None,
        warehouse,
    ),
    Kind(
        "warehouse: 241 beams over 120°, 10 m, 0.5 m/s",
        narrow(241, 120, 10.0),
        Drive(0.5, 0.8, 0.1),
        None,
        warehouse,
    ),
    Kind(
        "warehouse: 360 beams around, 3.5 m, 0.2 m/s",
        turning(360, 3.5, 0.02, 0.05),
        Drive(0.2, 0.8, 0.2),
        None,
        warehouse,
    ),
    Kind(
        "bare corridors: 241 beams over 60°, 8 m, 0.4 m/s",
        narrow(241, 60, 8.0),
        Drive(0.4, 0.8, 0.1),
        None,
        bare_corridors,
    ),
    Kind(
        "bare corridors: 37 beams over 180°, 10 m, 0.5 m/s",
        narrow(37, 180, 10.0),
        Drive(0.5, 0.8, 0.1),
        None,
        bare_corridors,
    ),
    Kind(
        "grounds: 64 beams over 240°, 8 m, 0.5 m/s", narrow(64, 240, 8.0), Drive(0.5, 0.8, 0.1), None, grounds
    ),
)


def recorded(kind: Kind, seed: int, odometry: str) -> tuple[LaserLog, Array]:
    """The log of one drive, and the true poses (S, 3) of its scans."""
    errors = ODOMETRY[odometry]
    if kind.place is not None:
        recording = drive_through(kind.place(seed), kind.laser, kind.how, errors, seed)
        return recording.log(), recording.truth
    building_ = building(2, 2, seed)
    way = building_.crossings(WAY)
    if kind.turning is None:
        recording = drive(building_, way, "building", None, kind.laser, kind.how, seed)
        return recording.log(), recording.truth
    path = fine_path(way, kind.how)
    swept = record_swept("building", building_.world, path, kind.laser, kind.turning, seed, errors)
    return swept.log(), swept.truth


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
