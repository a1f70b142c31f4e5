"""Where the robot was, and how the laser sits on it, from a recording's odometry and transforms."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.logs.assemble import Findings
from nscan_cli.logs.decoding import UNDECODABLE, placed_decoder
from nscan_cli.logs.frames import LARGEST_TILT, Frames, as_matrix, heading, planar, unmoved
from nscan_cli.logs.odometry import interpolated
from nscan_cli.logs.options import ReadingOptions
from nscan_cli.logs.order import Order
from nscan_cli.logs.recording import TRANSFORMS, Recording
from nscan_cli.logs.sensed import Placed, S, Sweep
from nscan_cli.logs.skips import Skips
from nscan_cli.logs.topics import odometry_topic
from nscan_cli.poses import Array

STATIC = "tf_static"
ODOM = "odom"
BASES = ("base_footprint", "base_link")
"""Frames of a robot (ROS REP 105), the one to be preferred first."""


class Transforms:
    """The transforms of a recording: those that are fixed by name at once, the others when asked for."""

    def __init__(self, recording: Recording, skips: Skips, file: str) -> None:
        self.recording, self.skips, self.file = recording, skips, file
        self.frames = Frames()
        self.moving: list[tuple[Placed, int]] | None = None
        for placed, _ in self._read(static=True):
            self.frames.add(placed)

    def all_moving(self) -> list[tuple[Placed, int]]:
        """The transforms of all other topics, with the times (ns) when they were recorded.

        Those that never move become fixed ones: ROS 1 sends these again and again.
        """
        if self.moving is None:
            self.moving = list(self._read(static=False))
            for placed in unmoved(placed for placed, _ in self.moving):
                if (placed.parent, placed.child) not in self.frames.fixed:
                    self.frames.add(placed)
        return self.moving

    def _read(self, static: bool) -> Iterator[tuple[Placed, int]]:
        for topic in self.recording.topics(TRANSFORMS):
            if topic.rpartition("/")[2].startswith(STATIC) == static:
                yield from _decoded(self.recording, topic, self.skips, self.file)


def odometry(
    recording: Recording,
    times: Order,
    header_time: bool,
    options: ReadingOptions,
    findings: Findings,
    file: str,
) -> tuple[Array | None, str, Transforms]:
    """Poses of the robot (S, 3) in order of time or None, the frame of the robot, and the transforms.

    The frame is empty where nothing names it. Raises WrongUsageError when topics have to be chosen.
    """
    transforms = Transforms(recording, findings.skips, file)
    if not options.odometry:
        findings.used["odometry"] = "none: --no-odometry"
        return None, "", transforms
    choice = odometry_topic(recording, options, file)
    if choice is not None:
        placed = list(_decoded(recording, choice.topic, findings.skips, file))
        robot = placed[0][0].child if placed else ""
        source, why = choice.topic, choice.why
    else:
        placed, robot = _odometry_in_tf(transforms, file)
        source = f"tf from {placed[0][0].parent} to {robot}" if placed else ""
        why = "no topic has odometry" if options.odom_topic is None else f"{options.odom_topic} is asked for"
    poses = _poses(placed, source or "tf", times, header_time, findings)
    if poses is not None:
        findings.used["odometry"] = f"{source}, {why}, interpolated"
    else:
        findings.used["odometry"] = "none in the recording" if not placed else f"none: {source} is of no use"
        if not placed:
            findings.warnings.append("no nav_msgs/Odometry, and no transform from odom: no odometry")
    return poses, robot, transforms


def mounting(
    sweeps: Sequence[Sweep],
    robot: str,
    transforms: Transforms,
    options: ReadingOptions,
    findings: Findings,
    file: str,
) -> tuple[Array, bool]:
    """The laser on the robot, and whether it hangs upside down: as the user says, else by fixed transforms.

    Raises InputDataError when the laser is tilted or moves.
    """
    if options.mount is not None:
        findings.used["mounting"] = "--mount"
        return np.array(options.mount, dtype=np.float64), False
    laser = sweeps[0].frame
    own = {sweep.pose for sweep in sweeps} - {None}
    if len(own) > 1:
        raise InputDataError(file, "its laser moves on the robot: its scans have different poses",
                             "give --mount X,Y,DEG to use them as if it did not")  # fmt: skip
    found = _chain(transforms, robot, laser)
    chain, matrix = ([laser], np.eye(4)) if found is None else found
    if found is None:
        names = " or ".join([robot] if robot else BASES)
        findings.used["mounting"] = "assumed: at the robot's centre"
        findings.warnings.append(
            f"no transforms lead from {names} to {laser or 'the unnamed frame of the scans'}: "
            "the laser is taken as at the robot's centre; see --mount"
        )
    elif len(chain) == 1:
        findings.used["mounting"] = f"none: the scans are in the robot's frame, {laser}"
    else:
        findings.used["mounting"] = f"tf {' → '.join(chain)}"
    for pose in own:
        inside = None if pose is None else as_matrix(pose)
        matrix = matrix if inside is None else matrix @ inside
    mount, hanging, tilt = planar(matrix)
    if tilt > LARGEST_TILT:
        problem = f"its laser is tilted by {math.degrees(tilt):.1f}° (tf {' → '.join(chain)})"
        raise InputDataError(file, problem, "give --mount X,Y,DEG to use its scans as if it were not")
    if hanging:
        findings.used["mounting"] += ", upside down"
    return mount, hanging


def _chain(transforms: Transforms, robot: str, laser: str) -> tuple[list[str], Array] | None:
    """The chain from the robot's frame, or what is called so, to the laser's."""
    frames = transforms.frames

    def found() -> tuple[list[str], Array] | None:
        bases = [robot] if robot else [n for base in BASES for n in sorted(frames.names()) if _is(n, base)]
        return next((chain for base in bases if (chain := frames.chain(base, laser)) is not None), None)

    chain = found()
    if chain is None:
        transforms.all_moving()
        chain = found()
    return chain


def _odometry_in_tf(transforms: Transforms, file: str) -> tuple[list[tuple[Placed, int]], str]:
    """The transforms from odom to the robot, and the robot's frame.

    Raises WrongUsageError when several frames are placed in odom.
    """
    rows = [row for row in transforms.all_moving() if _is(row[0].parent, ODOM)]
    robots = sorted({placed.child for placed, _ in rows})
    if len(robots) > 1:
        bases = [name for name in robots if any(_is(name, base) for base in BASES)]
        if len(bases) != 1:
            raise WrongUsageError(
                f"{file}: tf places several frames in odom, {', '.join(robots)}; "
                "choose a topic by --odom-topic, or none by --no-odometry"
            )
        robots = bases
    return [row for row in rows if row[0].child in robots], robots[0] if robots else ""


def _poses(
    placed: Sequence[tuple[Placed, int]], source: str, times: Order, header_time: bool, findings: Findings
) -> Array | None:
    """Poses (S, 3) at the times of the scans, by the clock that these have."""
    rows, stamps = [], []
    for number, (one, log_time) in enumerate(placed, 1):
        angle = heading(one.pose)
        if angle is None:
            findings.skips.add(f"{source}: not a pose", number)
            continue
        rows.append((one.pose.translation[0], one.pose.translation[1], angle))
        stamps.append((one.stamp if header_time and one.stamp > 0 else log_time) / S)
    if not rows:
        return None
    if times.nominal:
        findings.warnings.append(f"the scans have no times that lead to {source}: no odometry")
        return None
    at = np.array(stamps)
    in_order = np.argsort(at, kind="stable")
    return interpolated(
        times.times, at[in_order], np.array(rows)[in_order], f"pose of {source}", findings.warnings
    )


def _decoded(recording: Recording, topic: str, skips: Skips, file: str) -> Iterator[tuple[Placed, int]]:
    """What the messages of a topic place, with the times when they were recorded."""
    messages = recording.messages.get(topic, [])
    decoders = {
        channel: placed_decoder(channel, file) for channel in dict.fromkeys(m.channel for m in messages)
    }
    for number, message in enumerate(messages, 1):
        try:
            found = decoders[message.channel](message.data)
        except UNDECODABLE:
            skips.add(f"{topic}: cannot be decoded", number)
            continue
        for placed in found:
            yield placed, message.log_time


def _is(name: str, base: str) -> bool:
    """Whether a frame is called `base`, whatever robot it is of."""
    return name.rpartition("/")[2] == base
