"""Named scenes: a floor plan, a way through it, a laser."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from nscan_cli.poses import Array
from tests.simulation.drive import Drive, Odometry, poses
from tests.simulation.laser import Laser
from tests.simulation.office import office_way, office_world
from tests.simulation.recording import Recording, record
from tests.simulation.world import Builder, World


@dataclass(frozen=True)
class Scene:
    """All that is needed to record a drive."""

    name: str
    world: World
    waypoints: Array
    """(W, 2)"""
    drive: Drive = field(default_factory=Drive)
    laser: Laser = field(default_factory=Laser)
    errors: Odometry = field(default_factory=Odometry)

    def truth(self) -> Array:
        """(S, 3) true poses of the drive, in the floor plan's frame."""
        return poses(self.waypoints, self.drive)

    def record(self, seed: int, laser: Laser | None = None, errors: Odometry | None = None) -> Recording:
        """The drive recorded; another laser or other odometry errors may be given."""
        return self.record_at(self.truth(), seed, laser, errors)

    def record_at(
        self, truth: Array, seed: int, laser: Laser | None = None, errors: Odometry | None = None
    ) -> Recording:
        """Scans from any true poses (S, 3)."""
        period = self.drive.period
        return record(self.name, self.world, truth, laser or self.laser, seed, errors or self.errors, period)


def office() -> Scene:
    """An office floor of 40 × 25 m: a corridor in a loop, driven nearly twice, with visits to its rooms."""
    return Scene("office", office_world(), office_way())


def bare_corridor() -> Scene:
    """Two walls, 2 m apart and 120 m long: nothing tells how far along one is."""
    plan = Builder()
    plan.line(-60.0, -1.0, 60.0, -1.0)
    plan.line(-60.0, 1.0, 60.0, 1.0)
    return Scene("bare_corridor", plan.world(), np.array([(-20.0, 0.0), (20.0, 0.0)]))


def tee() -> Scene:
    """A bare corridor of 25 m, and a wall across its end."""
    plan = Builder()
    plan.line(-25.0, -1.0, 0.0, -1.0)
    plan.line(-25.0, 1.0, 0.0, 1.0)
    plan.line(-25.0, -1.0, -25.0, 1.0)
    for y in (-8.0, 8.0):
        plan.line(0.0, np.sign(y), 0.0, y)
        plan.line(0.0, y, 2.0, y)
    plan.line(2.0, -8.0, 2.0, 8.0)
    return Scene("tee", plan.world(), np.array([(-18.0, 0.0), (1.0, 0.0), (1.0, 6.0)]))


def corridor_and_room() -> Scene:
    """The situation of the paper's Fig. 3; `FIG_3` has the poses of its three scans.

    From the corridor (1) the laser sees both walls of the corridor and the room's far wall. Turned back
    in the room (2) it sees the corridor's walls, but not the far wall, so that 1 and 2 leave the
    direction of the corridor open. On the way out by another door (3) it sees the far wall, but not the
    corridor, so that 1 and 3 leave the direction across open. The corner beside the first door and a
    cabinet there, which 2 and 3 both see, tie these.
    """
    floor = Builder()
    floor.line(-12.0, -1.0, 0.0, -1.0)
    floor.line(-12.0, 1.0, 0.0, 1.0)
    floor.line(-12.0, -1.0, -12.0, 1.0)
    floor.line(0.0, -4.0, 0.0, -1.0)
    floor.line(0.0, 1.0, 0.0, 4.0)
    floor.line(0.0, -4.0, 6.0, -4.0)
    floor.line(6.0, -4.0, 6.0, 4.0)
    floor.line(0.0, 4.0, 4.5, 4.0)
    floor.line(5.5, 4.0, 6.0, 4.0)
    floor.line(4.5, 4.0, 4.5, 4.15)
    floor.line(5.5, 4.0, 5.5, 4.15)
    floor.line(-2.0, 4.15, 4.5, 4.15)
    floor.line(5.5, 4.15, 12.0, 4.15)
    floor.line(-2.0, 6.15, 12.0, 6.15)
    floor.line(-2.0, 4.15, -2.0, 6.15)
    floor.line(12.0, 4.15, 12.0, 6.15)
    floor.box(1.0, 3.5, 2.0, 4.0)
    floor.box(0.5, -4.0, 2.1, -3.3)
    waypoints = np.array(
        [(-8.0, 0.0), (3.3, 0.3), (2.2, 0.3), (4.0, 0.0), (5.0, 2.6), (5.0, 5.1), (9.0, 5.1)]
    )
    return Scene("corridor_and_room", floor.world(), waypoints)


FIG_3 = np.array([(-3.0, 0.0, 0.0), (2.5, 0.3, np.pi), (4.0, 0.0, np.radians(75.0))])
"""True poses (3, 3) of the three scans of the paper's Fig. 3 in corridor_and_room()."""
