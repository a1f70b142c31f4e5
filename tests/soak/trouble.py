"""Physical trouble in good logs: `python -m tests.soak.trouble`. The table of docs/trouble.md.

Simulated drives, and mit-csail and intel where NSCAN_DATA has them. There the map of the log without
trouble counts as the truth.
"""

from __future__ import annotations

import dataclasses
import resource
import sys
import time
from collections.abc import Mapping

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.slam.diagnostics.notices import notices
from tests.data import find_data
from tests.slam import trouble_cases
from tests.slam.keyframe_drives import round_scene
from tests.slam.mapped_logs import mapped
from tests.slam.trouble_cases import ROUND, Case, Make, errors, without_odometry

REAL: dict[str, tuple[ReadingOptions, dict[str, Make]]] = {
    "mit-csail": (
        ReadingOptions(),
        {
            "none": ROUND["none"],
            "3 m without a return": lambda log: trouble_cases.blind(log, 200, 203),
            "5 s of scans dropped": lambda log: trouble_cases.dropped(log, 200, 205),
            "carried by 10 m": lambda log: trouble_cases.carried(log, 200, 210),
            "kidnapped to a place seen before": lambda log: trouble_cases.kidnapped(log, 200, 20, 120),
            "laser frozen for 5 m": lambda log: trouble_cases.frozen(log, 200, 205),
            "odometry reset to 0": lambda log: trouble_cases.odometry_reset(log, 200),
            "odometry wraps round": lambda log: trouble_cases.odometry_wrapped(log, 100),
            "clock set back by 30 s": lambda log: trouble_cases.clock_jump(log, 200, -30.0),
        },
    ),
    "intel": (
        ReadingOptions(end=900.0),
        {
            "none": ROUND["none"],
            "carried by 10 m": lambda log: trouble_cases.carried(log, 100, 110),
            "kidnapped to a place seen before": lambda log: trouble_cases.kidnapped(log, 130, 10, 100),
            "laser frozen for 5 m": lambda log: trouble_cases.frozen(log, 100, 105),
            "odometry reset to 0": lambda log: trouble_cases.odometry_reset(log, 100),
        },
    ),
}


TOLD = {
    "scans are missing before": "scans are missing",
    "disagree": "odometry and scans disagree",
    "contradict": "relations contradict each other",
    "do not see what": "scans see other things",
    "pass through": "places look different",
    "the scans jump": "the scans jump",
    "the robot was carried, or odometry": "the robot was carried",
    "it is frozen, or": "the laser hangs, or the robot stands",
}
"""Words of a notice → what the table says of it."""


def _row(name: str, case: Case) -> None:
    found = mapped(case.log)
    state, graph = found.state, found.graph
    error = errors(case, graph.poses)
    said = [
        f"{len(what)} {word} at {' '.join(map(str, what[:3]))}"
        for word, what in (("breaks", state.breaks), ("jumps", state.odometry_jumps.tolist()))
        if what
    ]
    said += [f"{len(state.frozen_scans)} scans of a laser that hangs"] if len(state.frozen_scans) else []
    told = " ".join(notices(state))
    said += [short for words, short in TOLD.items() if words in told]
    accepted = sum(loop.accepted for loop in graph.loops)
    print(
        f"| {name} | {'; '.join(said) or '–'} | {accepted} of {len(graph.loops)} "
        f"| {error.before:.3f} | {error.after:.3f} | {error.whole:.3f} |",
        flush=True,
    )


def _table(title: str, log: LaserLog, cases: Mapping[str, Make]) -> None:
    print(f"\n{title}: {len(log)} scans\n")
    print("| Trouble | What is said | Loops | Before, m | Behind, m | Whole, m |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, make in cases.items():
        _row(name, make(log))


def _without(make: Make) -> Make:
    return lambda log: without_odometry(make(log))


def _standing(scans: int) -> None:
    log = trouble_cases.standing(scans)
    began = time.process_time()
    graph = mapped(log).graph
    seconds = time.process_time() - began
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    farthest = float(np.hypot(graph.poses[:, 0], graph.poses[:, 1]).max())
    print(
        f"\nstanding for {scans:,} scans: {len(graph.keyframes)} keyframes, moved {farthest:.3f} m, "
        f"{seconds:.1f} s of processor time, {peak:.0f} MB"
    )


def main() -> None:
    """Print everything."""
    log = round_scene().record(5).log()
    _table("with odometry", log, ROUND)
    blind = {name: make for name, make in ROUND.items() if not name.startswith("odometry")}
    without = {name: _without(make) for name, make in blind.items()}
    _table("without odometry", log, without)
    alike = trouble_cases.rooms_alike().record(1).log()
    _table("two rooms alike", alike, {"driven from one to the other": ROUND["none"]})
    _standing(36_000)
    for name, (reading, cases) in REAL.items():
        path = find_data(f"{name}.log.gz")
        if path is None:
            print(f"\n{name} is not there", file=sys.stderr)
            continue
        real = read_log(str(path), reading)
        clean = mapped(real).graph
        _table(name, dataclasses.replace(real, truth_times=real.times, truth=clean.poses), cases)


if __name__ == "__main__":
    main()
