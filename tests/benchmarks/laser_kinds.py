"""The lasers, robots and places of the benchmark `lasers`, and the logs of their drives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array
from tests.simulation.building import building, drive
from tests.simulation.drive import Drive, Odometry
from tests.simulation.laser import Laser
from tests.simulation.places import Place, bare_corridors, drive_through, grounds, warehouse
from tests.simulation.sweeping import Turning, fine_path, record_swept

WAY = [(0, 0), (2, 0), (2, 2), (0, 2), (0, 1), (1, 1), (1, 0), (0, 0), (0, 1), (2, 1), (2, 0), (1, 0), (1, 2)]
"""Crossings of corridors, 300 m of way; the robot comes back to most corridors, also from their other end."""
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


def in_place(
    sees: str, laser: Laser, speed: float, place: Callable[[int], Place], period: float = 0.1
) -> Kind:
    """A laser that `sees` so far, on a robot with a speed (m/s) that scans every `period` (s)."""
    names: dict[Callable[[int], Place], str] = {
        warehouse: "warehouse",
        bare_corridors: "bare corridors",
        grounds: "grounds",
    }
    return Kind(f"{names[place]}: {sees}, {speed} m/s", laser, Drive(speed, 0.8, period), place=place)


NARROW = (
    in_place("181 beams over 90°, 20 m", narrow(181, 90, 20.0), 0.8, warehouse),
    in_place("241 beams over 120°, 10 m", narrow(241, 120, 10.0), 0.5, warehouse),
    in_place("360 beams around, 3.5 m", turning(360, 3.5, 0.02, 0.05), 0.2, warehouse, 0.2),
    in_place("241 beams over 60°, 8 m", narrow(241, 60, 8.0), 0.4, bare_corridors),
    in_place("37 beams over 180°, 10 m", narrow(37, 180, 10.0), 0.5, bare_corridors),
    in_place("64 beams over 240°, 8 m", narrow(64, 240, 8.0), 0.5, grounds),
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
