"""Which topics of a recording are used, and why."""

from __future__ import annotations

from dataclasses import dataclass

from nscan_cli.counting import counted
from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.logs.options import ReadingOptions
from nscan_cli.logs.recording import ODOMETRY, SCANS, TRANSFORMS, Recording


@dataclass(frozen=True)
class Choice:
    """A topic, and why it is used."""

    topic: str
    why: str


def scan_topic(recording: Recording, options: ReadingOptions, file: str) -> Choice:
    """The topic of the scans: the one asked for, else the only one.

    Raises InputDataError when there is none, WrongUsageError when the one asked for does not do or there
    are several and none is asked for.
    """
    there = recording.topics(SCANS)
    if options.topic is not None:
        if options.topic not in there:
            raise WrongUsageError(
                f"{file}: {_unfit(recording, options.topic)}; --topic can be {_said(there)}"
            )
        return Choice(options.topic, "chosen by --topic")
    if not there:
        found = ", ".join(recording.listed()) or "nothing"
        known = " or ".join(SCANS)
        raise InputDataError(file, f"has no laser scans, only {found}", f"give a recording with {known}")
    if len(there) > 1:
        raise WrongUsageError(f"{file}: has several lasers, {_said(there)}; choose one by --topic")
    return Choice(next(iter(there)), "the only topic with scans")


def odometry_topic(recording: Recording, options: ReadingOptions, file: str) -> Choice | None:
    """The topic of the odometry, which may be one of transforms; None when tf has to be searched for it.

    Raises WrongUsageError as scan_topic does.
    """
    there, frames = recording.topics(ODOMETRY), recording.topics(TRANSFORMS)
    if options.odom_topic is not None:
        if options.odom_topic in frames:
            return None
        if options.odom_topic not in there:
            problem = _unfit(recording, options.odom_topic)
            raise WrongUsageError(f"{file}: {problem}; --odom-topic can be {_said(there | frames)}")
        return Choice(options.odom_topic, "chosen by --odom-topic")
    if len(there) > 1:
        remedy = "choose one by --odom-topic, or none by --no-odometry"
        raise WrongUsageError(f"{file}: has several odometries, {_said(there)}; {remedy}")
    return Choice(next(iter(there)), "the only topic with odometry") if there else None


def _unfit(recording: Recording, topic: str) -> str:
    types = [channel.type or "no schema" for channel in recording.counts if channel.topic == topic]
    return f"{topic} is of {types[0]}" if types else f"has no topic {topic}"


def _said(topics: dict[str, int]) -> str:
    return (
        ", ".join(f"{topic} ({counted(count, 'message')})" for topic, count in topics.items()) or "left out"
    )
