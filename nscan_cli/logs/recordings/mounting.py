"""How the laser of a recording sits on its robot: as the user says, else as its transforms do."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.logs.assemble import Findings
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.recordings.decoded_messages import Sweep
from nscan_cli.logs.recordings.moving_mount import Course, Link, at_rest, course, links
from nscan_cli.logs.recordings.tf_chains import LARGEST_TILT, Pair, Timed, over_time, planar, way
from nscan_cli.logs.recordings.tf_messages import BASES, Transforms, base_of, is_world, robot_of
from nscan_cli.poses import Array


class MountingError(InputDataError):
    """A laser is mounted so that no map can be made of its scans; --mount can say otherwise."""

    def __init__(self, file: str, problem: str, remedy: str) -> None:
        super().__init__(file, problem, remedy)
        self.problem = problem


def mounting(
    sweeps: Sequence[Sweep],
    robot: str,
    transforms: Transforms,
    options: ReadingOptions,
    findings: Findings,
    file: str,
) -> tuple[Array, bool, str]:
    """The laser on the robot, whether it hangs upside down, and the robot's frame as far as it is known.

    As the user says, else by the transforms between `robot` (empty where nothing names it) and the laser.
    Of some that move as a stabiliser's do, the mean is taken. Raises MountingError when the laser is
    tilted, or moves otherwise.
    """
    if options.mount is not None:
        findings.used["mounting"] = "--mount"
        return np.array(options.mount, dtype=np.float64), False, robot
    chain, names, why = _chain(transforms, robot, sweeps[0].frame, file)
    if names is None:
        findings.used["mounting"] = "assumed: at the robot's centre"
        findings.warnings.append(f"{why}: the laser is taken as at the robot's centre; see --mount")
        names = [sweeps[0].frame]
    elif len(names) == 1:
        findings.used["mounting"] = f"none: the scans are in the robot's frame, {names[0]}"
        robot = names[0]
    else:
        findings.used["mounting"] = why
        robot = names[0]
    chain += _own(sweeps)
    moved = course(chain)
    if moved is None:
        mount, hanging, tilt = planar(at_rest(chain))
        if tilt > LARGEST_TILT:
            problem = f"its laser is tilted by {math.degrees(tilt):.1f}° (tf {' → '.join(names)})"
            raise MountingError(file, problem, "give --mount X,Y,DEG to use its scans as if it were not")
    elif moved.unfit():
        raise _unfit(moved, chain, names, file)
    else:
        mount, hanging = moved.mount, moved.hangs
        findings.used["mounting"] += f"; {_movers(chain)}, {moved.extent()}: its mean is taken"
    if hanging:
        findings.used["mounting"] += ", upside down"
    return mount, hanging, robot


def _chain(
    transforms: Transforms, robot: str, laser: str, file: str
) -> tuple[list[Link], list[str] | None, str]:
    """The transforms from the robot's frame to the laser's with the frames' names, and why these.

    Without such transforms there are no names, and it is said why. Raises MountingError where the laser
    nods on whatever it hangs on, the robot or not.
    """
    for base, moving in _tries(transforms, robot):
        fixed = transforms.frames.fixed
        names = way([*fixed, *moving], base, laser)
        if names is not None:
            why = f"tf {' → '.join(names)}"
            if robot and base != robot:
                why += f", as if {base} were {robot}, from which no transforms lead"
            return links(names, fixed, moving), names, why
    if not robot and base_of(laser) in BASES:
        return [], [laser], ""
    fixed, moving = transforms.frames.fixed, _on_robot(transforms)
    names = _hanging_on([*fixed, *moving], laser)
    chain = links(names, fixed, moving)
    moved = course(chain)
    if moved is not None and moved.nods:
        raise _unfit(moved, chain, names, file)
    scans = laser or "the unnamed frame of the scans"
    if not robot and not fixed and not moving:
        return [], None, f"the recording has no transforms, so none lead to {scans}"
    return [], None, f"no transforms lead from {robot or ' or '.join(BASES)} to {scans}"


def _tries(transforms: Transforms, robot: str) -> Iterator[tuple[str, Mapping[Pair, Timed]]]:
    """The frames to look for the laser from, and the moving transforms to go along beside the fixed ones.

    First in those that are fixed by name, then in all that never move, then in those that move. A robot
    that odometry calls by one of BASES may have the other one in tf: REP 105 has one above the other.
    """
    if robot:
        yield robot, {}
        transforms.others()
        yield robot, {}
        yield robot, _on_robot(transforms)
    if robot and base_of(robot) not in BASES:
        return
    for stage in ("fixed by name", "never moves", "moves"):
        if stage != "fixed by name":
            transforms.others()
        moving = _on_robot(transforms) if stage == "moves" else {}
        known = transforms.frames.names() | {name for pair in moving for name in pair}
        for base in BASES:
            for name in sorted(known):
                is_other = not robot or (name != robot and robot_of(name) == robot_of(robot))
                if base_of(name) == base and is_other:
                    yield name, moving


def _on_robot(transforms: Transforms) -> dict[Pair, Timed]:
    """The transforms that move and are no robot's own motion."""
    return {pair: rows for pair, rows in transforms.moving().items() if not is_world(pair[0])}


def _hanging_on(pairs: Sequence[Pair], laser: str) -> list[str]:
    """The frames from the one that the laser hangs on at last, short of the world, to the laser."""
    parents = {child: parent for parent, child in pairs if not is_world(parent)}
    names = [laser]
    while names[0] in parents and parents[names[0]] not in names:
        names.insert(0, parents[names[0]])
    return names


def _own(sweeps: Sequence[Sweep]) -> list[Link]:
    """The laser's poses in its scans' frame, where the messages have them."""
    found = [(sweep.stamp, sweep.pose) for sweep in sweeps if sweep.pose is not None]
    if len({pose for _, pose in found}) == 1:
        del found[1:]
    timed = over_time([pose for _, pose in found], [stamp for stamp, _ in found])
    return [Link("the pose in its scans", timed)] if len(timed.times) else []


def _unfit(moved: Course, chain: Sequence[Link], names: Sequence[str], file: str) -> MountingError:
    """The error that a laser moves on its robot so that no map can be made."""
    path = f" (tf {' → '.join(names)})" if len(names) > 1 else ""
    problem = f"its laser {moved.unfit()}: {_movers(chain)}{path}"
    return MountingError(file, problem, "give --mount X,Y,DEG to take it as still")


def _movers(chain: Sequence[Link]) -> str:
    """The sentence that says which transforms of a chain move."""
    movers = [link.name for link in chain if link.moves]
    return f"{' and '.join(movers)} move{'s' if len(movers) == 1 else ''}"
