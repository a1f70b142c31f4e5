"""The topics of the scans and of the odometry: those that the user names, else the only ones."""

from __future__ import annotations

from collections.abc import Sequence

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.logs.device_choice import Device, OpenChoiceError, device_list
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.recordings.container import Recording
from nscan_cli.logs.recordings.message_types import ODOMETRY_TYPES, SCAN_TYPES, TRANSFORM_TYPES


def scan_topic(recording: Recording, options: ReadingOptions, file: str) -> tuple[str, str]:
    """The topic of the scans, and why it is used.

    Raises InputDataError when there is none, WrongUsageError when the one that the user names has no scans,
    and OpenChoiceError when there are several and the user names none.
    """
    there = devices(recording, SCAN_TYPES)
    if options.topic is not None:
        return _asked_topic(recording, "--topic", options.topic, there, file), "chosen by --topic"
    if not there:
        found = ", ".join(recording.topic_counts()) or "nothing"
        known = " or ".join(SCAN_TYPES)
        raise InputDataError(file, f"has no laser scans, only {found}", f"give a recording with {known}")
    if len(there) > 1:
        raise OpenChoiceError(file, "laser", there, "--topic", "message")
    return there[0].name, "the only topic with scans"


def odometry_topic(recording: Recording, options: ReadingOptions, file: str) -> tuple[str, str] | None:
    """The topic of the odometry, and why it is used; None when it has to be searched for in tf.

    Raises WrongUsageError and OpenChoiceError as scan_topic does.
    """
    there, transforms = devices(recording, ODOMETRY_TYPES), devices(recording, TRANSFORM_TYPES)
    if options.odom_topic is not None:
        both = [*there, *transforms]
        asked = _asked_topic(recording, "--odom-topic", options.odom_topic, both, file)
        return None if find_topic(asked, transforms) else (asked, "chosen by --odom-topic")
    if len(there) > 1:
        raise OpenChoiceError(file, "odometry", there, "--odom-topic", "message")
    return (there[0].name, "the only topic with odometry") if there else None


def devices(recording: Recording, types: tuple[str, ...]) -> list[Device]:
    """The topics that have messages of some types."""
    kinds = {channel.topic: channel.type for channel in recording.counts if channel.type in types}
    return [Device(topic, kinds[topic], count) for topic, count in recording.topics_of(types).items()]


def find_topic(asked: str, there: Sequence[Device]) -> str | None:
    """The topic called so, else one that differs only by a slash in front; None without any."""
    names = [device.name for device in there]
    if asked in names:
        return asked
    return next((name for name in names if name.removeprefix("/") == asked.removeprefix("/")), None)


def type_problem(recording: Recording, topic: str) -> str:
    """Why a topic does not fit: its type, or that there is no such topic."""
    types = [channel.type or "no schema" for channel in recording.counts if channel.topic == topic]
    return f"{topic} is of {types[0]}" if types else f"has no topic {topic}"


def _asked_topic(recording: Recording, option: str, topic: str, there: Sequence[Device], file: str) -> str:
    found = find_topic(topic, there)
    if found is None:
        known = device_list(there, "message") or "left out"
        raise WrongUsageError(f"{file}: {type_problem(recording, topic)}; {option} can be {known}")
    return found
