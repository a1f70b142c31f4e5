"""Drives with one trouble each, and how far the maps made of them are from the truth."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array
from tests.logs.excerpts import truth_of
from tests.simulation import faults, odometry_faults, things_beside
from tests.simulation.scenes import Scene, office
from tests.simulation.world import Builder
from tests.slam.keyframe_drives import path_of
from tests.slam.mapped_logs import position_rmse


class Case(NamedTuple):
    """A log with a trouble: rows [0, before) come before it, rows [after, S) behind."""

    log: LaserLog
    before: int
    after: int


class Errors(NamedTuple):
    """Root mean square errors of positions, m."""

    whole: float
    before: float
    """Of the scans before the trouble, seen for themselves;"""
    after: float
    """and of those behind."""


def errors(case: Case, poses: Array) -> Errors:
    """How far poses (S, 3) are from the truth, each part laid over it as well as can be."""
    truth = truth_of(case.log)
    parts = (slice(None), slice(0, case.before), slice(case.after, None))
    return Errors(*(position_rmse(poses[rows], truth[rows]) for rows in parts))


def at_metre(log: LaserLog, metre: float) -> int:
    """The first row so far along the way (m)."""
    return int(np.searchsorted(path_of(truth_of(log)), metre))


def blind(log: LaserLog, since: float, until: float, reading: float = np.inf) -> Case:
    a, b = at_metre(log, since), at_metre(log, until)
    return Case(faults.without_returns(log, slice(a, b), reading), a, b)


def dropped(log: LaserLog, since: float, until: float) -> Case:
    a, b = at_metre(log, since), at_metre(log, until)
    return Case(faults.dropped(log, slice(a, b)), a, a)


def carried(log: LaserLog, since: float, until: float) -> Case:
    a, b = at_metre(log, since), at_metre(log, until)
    return Case(faults.carried(log, slice(a, b)), a, a)


def kidnapped(log: LaserLog, at: float, since: float, until: float) -> Case:
    """Lifted after so many metres, and put down where it has been, to drive the same way again."""
    a, b, c = (at_metre(log, metre) for metre in (at, since, until))
    return Case(faults.spliced([faults.taken(log, slice(0, a)), faults.taken(log, slice(b, c))]), a, a)


def frozen(log: LaserLog, since: float, until: float) -> Case:
    a, b = at_metre(log, since), at_metre(log, until)
    return Case(faults.frozen(log, slice(a, b)), a, b)


def odometry_reset(log: LaserLog, at: float) -> Case:
    row = at_metre(log, at)
    return Case(odometry_faults.reset(log, row), row, row)


def odometry_jump(log: LaserLog, at: float) -> Case:
    row = at_metre(log, at)
    return Case(odometry_faults.jump(log, row, (30.0, 5.0, 2.0)), row, row)


def odometry_spike(log: LaserLog, at: float) -> Case:
    row = at_metre(log, at)
    return Case(odometry_faults.spike(log, row, (300.0, 5.0, 2.0)), row, row + 1)


def odometry_missing(log: LaserLog, since: float, until: float) -> Case:
    a, b = at_metre(log, since), at_metre(log, until)
    return Case(odometry_faults.missing(log, slice(a, b)), a, b)


def odometry_wrapped(log: LaserLog, at: float) -> Case:
    """The limit is what the robot reaches after so many metres, 16.4 m in simulation: 15 bits of mm."""
    assert log.odometry is not None
    row = at_metre(log, at)
    limit = float(np.abs(log.odometry[:row, :2]).max())
    return Case(odometry_faults.wrapped(log, limit), row, row)


def clock_jump(log: LaserLog, at: float, seconds: float) -> Case:
    row = at_metre(log, at)
    jumped = faults.clock_jump(log, row, seconds)
    # Set back by more than the log lasts, what was recorded last comes first.
    first = int(np.argmax(np.abs(np.diff(jumped.times)))) + 1 if abs(seconds) > 1000.0 else row
    return Case(jumped, first, first)


PASSING = np.array(
    [(12.0, 8.1, 30.0, 8.1), (32.6, 16.0, 32.6, 9.0), (28.0, 16.7, 10.0, 16.7), (6.4, 9.5, 6.4, 15.0)]
)
"""People who keep to one side of the office's corridors (W, 4)."""
BESIDE = np.array([(9.0, 7.0, 31.0, 8.0)])
"""Someone who walks along with the robot."""


def passing_people(log: LaserLog) -> Case:
    return _throughout(things_beside.people(log, PASSING))


def someone_beside(log: LaserLog) -> Case:
    return _throughout(things_beside.people(log, BESIDE))


def glass(log: LaserLog) -> Case:
    """The northern wall of the northern corridor is seen nearly head-on only."""
    return _throughout(faults.glass(log, (0.0, 40.0), (17.5, 19.0), 0.3))


def _throughout(log: LaserLog) -> Case:
    return Case(log, len(log) // 2, len(log) // 2)


def without_odometry(case: Case) -> Case:
    return case._replace(log=dataclasses.replace(case.log, odometry=None))


Make = Callable[[LaserLog], Case]

ROUND: dict[str, Make] = {
    "none": _throughout,
    "3 m without a return": lambda log: blind(log, 50, 53),
    "3 m of nan": lambda log: blind(log, 50, 53, np.nan),
    "15 m without a return": lambda log: blind(log, 45, 60),
    "glass wall, seen within 17° of head-on": glass,
    "3 s of scans dropped": lambda log: dropped(log, 40, 43.3),
    "10 s of scans dropped": lambda log: dropped(log, 40, 51),
    "carried by 2 m": lambda log: carried(log, 50, 52),
    "carried by 5 m": lambda log: carried(log, 50, 55),
    "carried by 10 m": lambda log: carried(log, 20, 30),
    "carried by 30 m": lambda log: carried(log, 20, 50),
    "carried by 30 m, nothing seen again": lambda log: carried(
        faults.taken(log, slice(0, at_metre(log, 64))), 20, 50
    ),
    "kidnapped to a place seen before": lambda log: kidnapped(log, 45, 5, 35),
    "laser frozen for 3 m": lambda log: frozen(log, 40, 43),
    "laser frozen for 8 m": lambda log: frozen(log, 40, 48),
    "odometry reset to 0": lambda log: odometry_reset(log, 50),
    "odometry jumps by 30 m and 2 rad": lambda log: odometry_jump(log, 50),
    "odometry wrong in one scan": lambda log: odometry_spike(log, 50),
    "odometry missing for 20 m": lambda log: odometry_missing(log, 30, 50),
    "odometry ends half-way": lambda log: odometry_missing(log, 40, 999),
    "odometry wraps round": lambda log: odometry_wrapped(log, 18),
    "clock set forward by 1 h": lambda log: clock_jump(log, 50, 3600.0),
    "clock set back by 1 h": lambda log: clock_jump(log, 50, -3600.0),
    "clock set back by 10 s": lambda log: clock_jump(log, 50, -10.0),
    "people who pass": passing_people,
    "someone who walks along": someone_beside,
}
"""Of round_scene(): 66 m round a corridor, and 16 m again."""


def standing(scans: int) -> LaserLog:
    """A robot that stands in the office; its readings are drawn from 500 that were simulated."""
    log = office().record_at(np.repeat(office().truth()[1900:1901], 500, axis=0), seed=2).log()
    chosen = faults.taken(log, np.random.default_rng(1).integers(0, 500, scans))
    times = 0.1 * np.arange(scans, dtype=np.float64)
    return dataclasses.replace(chosen, times=times, stamps=tuple(f"{time:.6f}" for time in times))


def rooms_alike() -> Scene:
    """Through two rooms with the same walls and furniture, 14 m apart, off one corridor."""
    floor = Builder()
    doors = (3.0, 17.0)
    floor.wall((-4.0, 0.0), (24.0, 0.0), tuple((x, 1.2) for x in doors))
    floor.wall((-4.0, -2.2), (24.0, -2.2))
    floor.wall((-4.0, -2.2), (-4.0, 0.0))
    floor.wall((24.0, -2.2), (24.0, 0.0))
    for x in doors:
        for wall in ((-3.0, 3.0), (3.0, 3.0)):
            floor.wall((x + wall[0], 0.0), (x + wall[0], 6.0))
        floor.wall((x - 3.0, 6.0), (x + 3.0, 6.0))
        floor.box(x - 2.9, 4.0, x - 2.2, 5.6)
        floor.box(x + 1.0, 5.3, x + 2.6, 5.9)
        floor.pillar(x + 1.6, 2.4, 0.3)
    floor.box(8.0, -2.1, 9.2, -1.7)
    floor.box(11.0, -0.5, 11.6, -0.1)
    way: list[tuple[float, float]] = [(-2.5, -1.1)]
    for x in doors:
        inside = [(x, -1.1), (x, 1.2), (x - 1.0, 3.2), (x, 4.6), (x + 1.0, 3.8), (x, 1.2), (x, -1.1)]
        way += inside
    return Scene("rooms_alike", floor.world(), np.array([*way, (22.0, -1.1)]))
