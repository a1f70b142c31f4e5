"""Where the robot was, from a recording's odometry and transforms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nscan_cli.logs.assemble import Findings
from nscan_cli.logs.choices import Device, OpenChoiceError
from nscan_cli.logs.odometry_interpolation import interpolated
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.recordings.container import ODOMETRY, TRANSFORMS, Recording
from nscan_cli.logs.recordings.decoded_messages import S
from nscan_cli.logs.recordings.tf_chains import heading
from nscan_cli.logs.recordings.tf_messages import BASES, ODOM, Logged, Transforms, base_of, decoded, stamps_of
from nscan_cli.logs.recordings.topics import devices, named, odometry_topic
from nscan_cli.logs.scan_order import Order
from nscan_cli.logs.skips import Skips
from nscan_cli.poses import Array


class RobotMotion(NamedTuple):
    """What a recording says of the robot's motion."""

    poses: Array | None
    """(S, 3) at the times of the scans, in order of time."""
    robot: str
    """The frame that is placed; empty where nothing names it."""
    parent: str
    """The frame that it is placed in, likewise."""


def robot_odometry(
    recording: Recording,
    transforms: Transforms,
    times: Order,
    header_time: bool,
    options: ReadingOptions,
    findings: Findings,
    file: str,
) -> RobotMotion:
    """The robot's motion by the topic that is asked for, by the only one, or by tf.

    Raises WrongUsageError and OpenChoiceError when topics have to be chosen.
    """
    if not options.odometry:
        findings.used["odometry"] = "none: --no-odometry"
        return RobotMotion(None, _robot(recording, transforms, findings.skips, file), "")
    placed = _in_odom(transforms) if _is_no_topic(recording, options.odom_topic) else {}
    choice = None if options.odom_topic in placed else odometry_topic(recording, options, file)
    if choice is not None:
        rows = list(decoded(recording, choice.topic, findings.skips, file))
        source, why = choice.topic, choice.why
    else:
        rows = placed.get(options.odom_topic or "", []) or _odometry_in_tf(transforms, file)
        source = f"tf from {rows[0][0].parent} to {rows[0][0].child}" if rows else ""
        why = "no topic has odometry" if options.odom_topic is None else f"{options.odom_topic} is asked for"
    poses = _poses(rows, source or "tf", times, header_time, findings)
    if poses is not None:
        findings.used["odometry"] = f"{source}, {why}, interpolated"
    else:
        findings.used["odometry"] = "none in the recording" if not rows else f"none: {source} is of no use"
        if not rows:
            findings.warnings.append("no nav_msgs/Odometry, and no transform from odom: no odometry")
    if not rows:
        return RobotMotion(poses, "", "")
    return RobotMotion(poses, rows[0][0].child, rows[0][0].parent)


def _robot(recording: Recording, transforms: Transforms, skips: Skips, file: str) -> str:
    """The robot's frame, as far as all odometry agrees on it."""
    topics = recording.topics(ODOMETRY)
    if topics:
        placed = [next(decoded(recording, topic, skips, file), None) for topic in topics]
        names = {one[0].child for one in placed if one is not None}
        return names.pop() if len(names) == 1 else ""
    try:
        rows = _odometry_in_tf(transforms, file)
    except OpenChoiceError:
        return ""
    return rows[0][0].child if rows else ""


def _odometry_in_tf(transforms: Transforms, file: str) -> list[Logged]:
    """The transforms from odom to the robot.

    Raises OpenChoiceError when several frames are placed in odom and may be the robot.
    """
    placed = _in_odom(transforms)
    bases = [name for name in placed if base_of(name) in BASES]
    robots = bases if len(bases) == 1 else list(placed)
    if len(robots) > 1:
        found = [Device(name, f"tf from {rows[0][0].parent}", len(rows)) for name, rows in placed.items()]
        raise OpenChoiceError(file, "odometry", found, "--odom-topic", "transform")
    return placed[robots[0]] if robots else []


def _in_odom(transforms: Transforms) -> dict[str, list[Logged]]:
    """The transforms from odom, by the frame that they place there."""
    placed: dict[str, list[Logged]] = {}
    for row in transforms.others():
        if base_of(row[0].parent) in ODOM:
            placed.setdefault(row[0].child, []).append(row)
    return dict(sorted(placed.items()))


def _is_no_topic(recording: Recording, asked: str | None) -> bool:
    """Whether something else than a topic is asked for as odometry: it may be a frame of tf."""
    return asked is not None and named(asked, devices(recording, ODOMETRY + TRANSFORMS)) is None


def _poses(
    rows: Sequence[Logged], source: str, times: Order, header_time: bool, findings: Findings
) -> Array | None:
    """Poses (S, 3) at the times of the scans, by the clock that these have."""
    found, at = [], []
    stamps = stamps_of(rows) if header_time else [log_time for _, log_time in rows]
    for number, ((one, _), stamp) in enumerate(zip(rows, stamps, strict=True), 1):
        angle = heading(one.pose)
        if angle is None or stamp is None:
            findings.skips.add(f"{source}: {'not a pose' if angle is None else 'without a time'}", number)
            continue
        found.append((one.pose.translation[0], one.pose.translation[1], angle))
        at.append(stamp / S)
    if not found:
        return None
    if times.nominal:
        findings.warnings.append(f"the scans have no times that lead to {source}: no odometry")
        return None
    moments = np.array(at)
    in_order = np.argsort(moments, kind="stable")
    return interpolated(
        times.times, moments[in_order], np.array(found)[in_order], f"pose of {source}", findings.warnings
    )
