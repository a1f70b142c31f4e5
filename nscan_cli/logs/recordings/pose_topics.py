"""The poses that one topic of a recording has, as of motion capture: a reference for results."""

from __future__ import annotations

import numpy as np

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.counting import counted
from nscan_cli.logs.recordings.container import ODOMETRY, POSES, TRANSFORMS, Recording
from nscan_cli.logs.recordings.decoded_messages import FramePose, S
from nscan_cli.logs.recordings.decoding import UNDECODABLE, placed_decoder
from nscan_cli.logs.recordings.tf_chains import heading, unmoved
from nscan_cli.poses import Array

PLACING = POSES + ODOMETRY + TRANSFORMS
BETWEEN = ":"
"""Stands between a topic of transforms and the frames: /tf:world.robot."""


def poses_on(
    recording: Recording, topic: str | None, file: str, notices: list[str]
) -> tuple[list[str], Array]:
    """Stamps (s, as text) and poses (N, 7), x, y, z and quaternion x, y, z, w, of a topic, in file order.

    A topic of transforms between several frames needs those that are meant: TOPIC:PARENT.CHILD. What a
    user should know is added to the notices. Raises WrongUsageError where the topic is not one that has
    poses, InputDataError where none of them can be read.
    """
    name, frames = _chosen(recording, topic, file)
    placed, log_times, wrong = _decoded(recording, name, file)
    pairs = dict.fromkeys((one.parent, one.child) for one in placed)
    if frames or len(pairs) > 1:
        pair = _pair(placed, list(pairs), frames, f"{file}: {name}")
        chosen = [row for row, one in enumerate(placed) if (one.parent, one.child) == pair]
        placed, log_times = [placed[row] for row in chosen], [log_times[row] for row in chosen]
    sound = [row for row, one in enumerate(placed) if heading(one.pose) is not None]
    wrong += len(placed) - len(sound)
    if wrong:
        notices.append(f"{file}: {counted(wrong, 'message')} on {name} skipped: no pose in it")
    if not sound:
        raise InputDataError(file, f"no pose on {name} can be read", "choose another topic")
    stamps = [placed[row].stamp for row in sound]
    if 2 * len(set(stamps)) < len(stamps):
        notices.append(f"{file}: the stamps on {name} say nothing: the times of recording are used")
        stamps = [log_times[row] for row in sound]
    poses = np.array([(*placed[row].pose.translation, *placed[row].pose.rotation) for row in sound])
    poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    return [f"{stamp // S}.{stamp % S:09d}" for stamp in stamps], poses


def _chosen(recording: Recording, topic: str | None, file: str) -> tuple[str, str]:
    """The topic, and what it says of frames."""
    there = recording.topics(PLACING)
    if not there:
        found = ", ".join(recording.listed()) or "nothing"
        raise InputDataError(file, f"has no topic with poses, only {found}", "give another reference")
    if topic is None:
        raise WrongUsageError(
            f"{file}: is a recording; say by --reference-topic which poses are the reference: "
            f"{_said(recording)}"
        )
    name, _between, frames = topic.partition(BETWEEN)
    if topic in there:
        return topic, ""
    if name in recording.topics(TRANSFORMS):
        return name, frames
    types = [channel.type or "no schema" for channel in recording.counts if channel.topic == topic]
    problem = f"{topic} is of {types[0]}, which has no poses" if types else f"has no topic {topic}"
    raise WrongUsageError(f"{file}: {problem}; --reference-topic can be {_said(recording)}")


def _decoded(recording: Recording, topic: str, file: str) -> tuple[list[FramePose], list[int], int]:
    """What messages place, with the times when they were recorded (ns), and how many cannot be decoded."""
    messages = recording.messages.get(topic, [])
    decoders = {
        channel: placed_decoder(channel, file) for channel in dict.fromkeys(m.channel for m in messages)
    }
    placed: list[FramePose] = []
    log_times: list[int] = []
    wrong = 0
    for message in messages:
        try:
            found = decoders[message.channel](message.data)
        except UNDECODABLE:
            wrong += 1
            continue
        placed += found
        log_times += [message.log_time] * len(found)
    return placed, log_times, wrong


def _pair(placed: list[FramePose], pairs: list[tuple[str, str]], frames: str, place: str) -> tuple[str, str]:
    """The frames that are asked for, or the only ones that move against each other."""
    still = {(one.parent, one.child) for one in unmoved(placed)}
    moving = [pair for pair in pairs if pair not in still] or pairs
    fitting = [pair for pair in pairs if ".".join(pair) == frames] if frames else moving
    if len(fitting) != 1:
        known = ", ".join(".".join(pair) for pair in moving)
        problem = f"has no transforms of {frames}" if frames else "has transforms of several frames"
        raise WrongUsageError(
            f"{place} {problem}; give --reference-topic TOPIC{BETWEEN}FRAMES, these are {known}"
        )
    return fitting[0]


def _said(recording: Recording) -> str:
    """The topics that can be chosen."""
    types = {channel.topic: channel.type.rpartition("/")[2] for channel in recording.counts}
    return ", ".join(
        f"{topic} ({types[topic]}, {counted(count, 'message')})"
        for topic, count in recording.topics(PLACING).items()
    )
