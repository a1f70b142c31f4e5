"""The poses on one topic of a recording, such as those of motion capture: a reference trajectory."""

from __future__ import annotations

import numpy as np

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.text import counted
from nscan_cli.logs.recordings.container import Recording
from nscan_cli.logs.recordings.decoded_messages import StampedTransform, decimal_seconds
from nscan_cli.logs.recordings.message_types import REFERENCE_TYPES, TRANSFORM_TYPES
from nscan_cli.logs.recordings.poses_3d import heading
from nscan_cli.logs.recordings.tf_chains import FramePair
from nscan_cli.logs.recordings.tf_tree import constant_transforms, decoded_transforms
from nscan_cli.logs.recordings.topics import type_problem
from nscan_cli.logs.skips import Skips
from nscan_cli.poses import Array

BEFORE_FRAMES = ":"
"""Separates a topic of transforms from the frames in --reference-topic: /tf:world.robot."""


def poses_on_topic(
    recording: Recording, topic: str | None, file: str, notices: list[str]
) -> tuple[list[str], Array]:
    """Stamps (s, as text) and poses (N, 7) of a topic: x, y, z, quaternion x, y, z, w; in file order.

    Where a topic has transforms of several pairs of frames that move, the user has to give the pair:
    TOPIC:PARENT.CHILD. Messages without a pose and unset stamps are added to the `notices`. Raises
    WrongUsageError when the topic has no poses, InputDataError when none of them can be read.
    """
    name, frames = _topic_and_frames(recording, topic, file)
    skips = Skips(file, strict=False, place="message")
    rows = list(decoded_transforms(recording, name, skips))
    transforms = [transform for transform, _ in rows]
    if frames or len({(one.parent, one.child) for one in transforms}) > 1:
        pair = _frame_pair(transforms, frames, f"{file}: {name}")
        rows = [row for row in rows if (row[0].parent, row[0].child) == pair]
    valid = [row for row in rows if heading(row[0].pose) is not None]
    skipped = len(rows) - len(valid) + sum(count for count, _first in skips.reasons.values())
    if skipped:
        notices.append(f"{file}: {counted(skipped, 'message')} on {name} skipped: no pose in it")
    if not valid:
        raise InputDataError(file, f"no pose on {name} can be read", "choose another topic")
    stamps = [transform.stamp for transform, _ in valid]
    if 2 * len(set(stamps)) < len(stamps):
        notices.append(f"{file}: the stamps on {name} are unusable: the times of recording are used")
        stamps = [log_time for _, log_time in valid]
    poses = np.array([(*one.pose.translation, *one.pose.rotation) for one, _ in valid])
    poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    return [decimal_seconds(stamp) for stamp in stamps], poses


def _topic_and_frames(recording: Recording, topic: str | None, file: str) -> tuple[str, str]:
    """The topic that --reference-topic names, and PARENT.CHILD (empty where it names none)."""
    there = recording.topics_of(REFERENCE_TYPES)
    if not there:
        found = ", ".join(recording.topic_counts()) or "nothing"
        raise InputDataError(file, f"has no topic with poses, only {found}", "give another reference")
    types = {channel.topic: channel.type.rpartition("/")[2] for channel in recording.counts}
    known = ", ".join(f"{name} ({types[name]}, {counted(count, 'message')})" for name, count in there.items())
    if topic is None:
        raise WrongUsageError(
            f"{file}: is a recording; say by --reference-topic which poses are the reference: {known}"
        )
    name, _separator, frames = topic.partition(BEFORE_FRAMES)
    if topic in there:
        return topic, ""
    if name in recording.topics_of(TRANSFORM_TYPES):
        return name, frames
    problem = type_problem(recording, topic) + (", which has no poses" if topic in types else "")
    raise WrongUsageError(f"{file}: {problem}; --reference-topic can be {known}")


def _frame_pair(transforms: list[StampedTransform], frames: str, place: str) -> FramePair:
    """The pair of frames that the user names, else the only one that moves. Raises WrongUsageError."""
    pairs = list(dict.fromkeys((one.parent, one.child) for one in transforms))
    fixed = {(one.parent, one.child) for one in constant_transforms(transforms)}
    moving = [pair for pair in pairs if pair not in fixed] or pairs
    fitting = [pair for pair in pairs if ".".join(pair) == frames] if frames else moving
    if len(fitting) != 1:
        known = ", ".join(".".join(pair) for pair in moving)
        problem = f"has no transforms of {frames}" if frames else "has transforms of several frames"
        raise WrongUsageError(
            f"{place} {problem}; give --reference-topic TOPIC{BEFORE_FRAMES}FRAMES, these are {known}"
        )
    return fitting[0]
