"""The robot's odometry in a recording: from a topic, or from the transforms (tf) out of odom."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nscan_cli.logs.assemble import ReaderFindings
from nscan_cli.logs.device_choice import Device, OpenChoiceError
from nscan_cli.logs.odometry_interpolation import interpolated_poses
from nscan_cli.logs.recordings.decoded_messages import S
from nscan_cli.logs.recordings.frame_ids import BASE_FRAMES, ODOM_FRAMES, without_prefix
from nscan_cli.logs.recordings.message_stamps import are_in_seconds
from nscan_cli.logs.recordings.message_types import ODOMETRY_TYPES, TRANSFORM_TYPES
from nscan_cli.logs.recordings.orientations import headings_of
from nscan_cli.logs.recordings.poses_3d import heading
from nscan_cli.logs.recordings.tf_tree import (
    LoggedTransform,
    TransformTree,
    decoded_transforms,
    transform_times,
)
from nscan_cli.logs.recordings.topics import devices, find_topic, odometry_topic
from nscan_cli.logs.robot_path import RobotPath, robot_path
from nscan_cli.logs.scan_order import ScanOrder
from nscan_cli.poses import Array


class ScanClock(NamedTuple):
    """The times of the scans of a recording, and whose clock they are in."""

    times: ScanOrder
    stamped: bool
    """Whether they are the scans' stamps. Otherwise they are the times of recording."""
    delay: float
    """Median time from a scan's stamp to its recording, s; large where the two are in different clocks."""


class RobotMotion(NamedTuple):
    """The odometry of a recording, at the times of the scans."""

    poses: Array | None
    """(S, 3) in order of time; None without odometry."""
    path: RobotPath | None
    """The odometry at its own times."""
    robot: str
    """The child frame of the odometry; empty where nothing names it."""
    parent: str
    """The parent frame of the odometry; empty where nothing names it."""


def robot_odometry(tree: TransformTree, clock: ScanClock, findings: ReaderFindings) -> RobotMotion:
    """The robot's motion from the topic that --odom-topic names, from the only one, or from tf.

    Raises WrongUsageError and OpenChoiceError when topics have to be chosen.
    """
    options = findings.options
    if not options.odometry:
        findings.used["odometry"] = "none: --no-odometry"
        return RobotMotion(None, None, _robot_frame(tree), "")
    recording, asked = tree.recording, options.odom_topic
    is_frame = (
        asked is not None and find_topic(asked, devices(recording, ODOMETRY_TYPES + TRANSFORM_TYPES)) is None
    )
    by_frame = _transforms_from_odom(tree) if is_frame else {}
    choice = None if asked in by_frame else odometry_topic(recording, options, tree.skips.file)
    if choice is not None:
        source, why = choice
        rows = list(decoded_transforms(recording, source, tree.skips))
    else:
        rows = by_frame.get(asked or "", []) or _odometry_in_tf(tree)
        source = f"tf from {rows[0][0].parent} to {rows[0][0].child}" if rows else ""
        why = "no topic has odometry" if asked is None else f"{asked} is asked for"
    poses, path = _poses_at_scans(rows, source or "tf", clock, findings)
    if poses is not None:
        findings.used["odometry"] = f"{source}, {why}, interpolated"
    elif rows:
        findings.used["odometry"] = f"none: {source} cannot be used"
    else:
        findings.used["odometry"] = "none in the recording"
        findings.warnings.append("no nav_msgs/Odometry, and no transform from odom: no odometry")
    if not rows:
        return RobotMotion(poses, path, "", "")
    return RobotMotion(poses, path, rows[0][0].child, rows[0][0].parent)


def _robot_frame(tree: TransformTree) -> str:
    """The child frame of the odometry; empty where there is none, or topics name different ones."""
    topics = tree.recording.topics_of(ODOMETRY_TYPES)
    if topics:
        first = [next(decoded_transforms(tree.recording, topic, tree.skips), None) for topic in topics]
        frames = {logged[0].child for logged in first if logged is not None}
        return frames.pop() if len(frames) == 1 else ""
    try:
        rows = _odometry_in_tf(tree)
    except OpenChoiceError:
        return ""
    return rows[0][0].child if rows else ""


def _odometry_in_tf(tree: TransformTree) -> list[LoggedTransform]:
    """The transforms from odom to the robot.

    Raises OpenChoiceError when odom has several child frames that may be the robot.
    """
    by_frame = _transforms_from_odom(tree)
    bases = [frame for frame in by_frame if without_prefix(frame) in BASE_FRAMES]
    robots = bases if len(bases) == 1 else list(by_frame)
    if len(robots) > 1:
        found = [Device(frame, f"tf from {rows[0][0].parent}", len(rows)) for frame, rows in by_frame.items()]
        raise OpenChoiceError(tree.skips.file, "odometry", found, "--odom-topic", "transform")
    return by_frame[robots[0]] if robots else []


def _transforms_from_odom(tree: TransformTree) -> dict[str, list[LoggedTransform]]:
    """The transforms from odom, by their child frame."""
    by_frame: dict[str, list[LoggedTransform]] = {}
    for logged in tree.dynamic():
        if without_prefix(logged[0].parent) in ODOM_FRAMES:
            by_frame.setdefault(logged[0].child, []).append(logged)
    return dict(sorted(by_frame.items()))


def _poses_at_scans(
    rows: Sequence[LoggedTransform], source: str, clock: ScanClock, findings: ReaderFindings
) -> tuple[Array | None, RobotPath | None]:
    """Interpolated poses (S, 3) at the times of the scans, and the path; None without a valid pose.

    The clock offset of the options is added to the times of the poses.
    """
    found, found_at, delays, offset = [], [], [], findings.options.clock_offset
    as_written = [transform.pose for transform, _ in rows]
    if findings.options.as_recorded:
        angles = [heading(pose) for pose in as_written]
    else:
        angles, mended = headings_of(as_written)
        if mended:
            findings.contradictions.append(f"{source}: {mended}; --as-recorded reads them as they are")
    logged = [log_time - round(clock.delay * S) for _, log_time in rows]
    stamps = transform_times(rows) if clock.stamped else logged
    if not are_in_seconds(stamps):
        # In the clock of the scans.
        findings.warnings.append(f"the time stamps of {source} are unusable: the times of recording are used")
        stamps = [*logged]
    for number, (row, stamp, angle) in enumerate(zip(rows, stamps, angles, strict=True), 1):
        transform, log_time = row
        if angle is None or stamp is None:
            findings.skips.add(f"{source}: {'not a pose' if angle is None else 'without a time'}", number)
            continue
        found.append((*transform.pose.translation[:2], angle))
        found_at.append(stamp / S)
        delays.append((log_time - stamp) / S)
    if not found:
        return None, None
    if clock.times.nominal:
        findings.warnings.append(f"the scans have no times to compare with {source}: no odometry")
        return None, None
    seconds, warnings = np.array(found_at) + offset, findings.warnings
    order = np.argsort(seconds, kind="stable")
    name, at = f"pose of {source}", clock.times.times
    seconds_in_order, in_order = seconds[order], np.array(found)[order]
    poses = interpolated_poses(at, seconds_in_order, in_order, name, warnings)
    apart = float(np.median(delays)) - clock.delay
    if poses is None and clock.stamped and _overlap(at, seconds - offset + apart):
        warnings.append(
            f"{source} and the scans are stamped by two clocks; from their times of recording, "
            f"--clock-offset {apart:.1f} corrects it"
        )
    return poses, None if poses is None else robot_path(seconds_in_order, in_order)


def _overlap(times: Array, others: Array) -> bool:
    return bool(((times >= others.min()) & (times <= others.max())).any())
