"""Which topics of a recording are used, and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.logs.choices import Device, OpenChoiceError, listed
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.recordings.container import ODOMETRY, SCANS, TRANSFORMS, Recording


@dataclass(frozen=True)
class Choice:
    """A topic, and why it is used."""

    topic: str
    why: str


def scan_topic(recording: Recording, options: ReadingOptions, file: str) -> Choice:
    """The topic of the scans: the one asked for, else the only one.

    Raises InputDataError when there is none, WrongUsageError when the one asked for does not do, and
    OpenChoiceError when there are several and none is asked for.
    """
    there = devices(recording, SCANS)
    if options.topic is not None:
        asked = named(options.topic, there)
        if asked is None:
            problem = _unfit(recording, options.topic)
            raise WrongUsageError(f"{file}: {problem}; --topic can be {_said(there)}")
        return Choice(asked, "chosen by --topic")
    if not there:
        found = ", ".join(recording.listed()) or "nothing"
        known = " or ".join(SCANS)
        raise InputDataError(file, f"has no laser scans, only {found}", f"give a recording with {known}")
    if len(there) > 1:
        raise OpenChoiceError(file, "laser", there, "--topic", "message")
    return Choice(there[0].name, "the only topic with scans")


def odometry_topic(recording: Recording, options: ReadingOptions, file: str) -> Choice | None:
    """The topic of the odometry, which may be one of transforms; None when tf has to be searched for it.

    Raises WrongUsageError and OpenChoiceError as scan_topic does.
    """
    there, frames = devices(recording, ODOMETRY), devices(recording, TRANSFORMS)
    if options.odom_topic is not None:
        asked = named(options.odom_topic, [*there, *frames])
        if asked is None:
            problem = _unfit(recording, options.odom_topic)
            raise WrongUsageError(f"{file}: {problem}; --odom-topic can be {_said([*there, *frames])}")
        return None if named(asked, frames) else Choice(asked, "chosen by --odom-topic")
    if len(there) > 1:
        raise OpenChoiceError(file, "odometry", there, "--odom-topic", "message")
    return Choice(there[0].name, "the only topic with odometry") if there else None


def devices(recording: Recording, types: tuple[str, ...]) -> list[Device]:
    """The topics that have messages of some types."""
    kinds = {channel.topic: channel.type for channel in recording.counts if channel.type in types}
    return [Device(topic, kinds[topic], count) for topic, count in recording.topics(types).items()]


def named(asked: str, there: Sequence[Device]) -> str | None:
    """The topic that is asked for, where there is one; a slash in front makes no difference of its own."""
    names = [one.name for one in there]
    if asked in names:
        return asked
    return next((name for name in names if name.removeprefix("/") == asked.removeprefix("/")), None)


def _unfit(recording: Recording, topic: str) -> str:
    types = [channel.type or "no schema" for channel in recording.counts if channel.topic == topic]
    return f"{topic} is of {types[0]}" if types else f"has no topic {topic}"


def _said(there: Sequence[Device]) -> str:
    return listed(there, "message") or "left out"
