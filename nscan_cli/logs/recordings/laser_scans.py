"""A recording's messages → the scans of one topic, with odometry and mounting."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.source import Source
from nscan_cli.logs import scan_order as order
from nscan_cli.logs.assemble import Findings, RawScans, RecordedMotion, laser_log, stacked
from nscan_cli.logs.frame_names import frame_names
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.range_limits import FARTHEST
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.recordings import robot_motion as recorded_motion
from nscan_cli.logs.recordings.container import ODOMETRY, SCANS, Channel, Message, Recording
from nscan_cli.logs.recordings.decoded_messages import S, Sweep
from nscan_cli.logs.recordings.decoding import UNDECODABLE, sweep_decoder
from nscan_cli.logs.recordings.message_stamps import is_clock, stamps_set
from nscan_cli.logs.recordings.mounting import mounting
from nscan_cli.logs.recordings.tf_messages import Transforms
from nscan_cli.logs.recordings.topics import devices, scan_topic
from nscan_cli.logs.skips import Skips
from nscan_cli.logs.text.line_records import beams_problem
from nscan_cli.poses import Array


def read(recording: Recording, file: str, source: Source, options: ReadingOptions) -> LaserLog:
    """The scans of one topic in order of time.

    Raises InputDataError when there are none, or the laser is tilted; WrongUsageError when the options do
    not fit the recording or have to choose between topics.
    """
    if options.laser is not None:
        raise WrongUsageError(f"{file}: has topics, no lasers by tag; leave out --laser, see --topic")
    choice = scan_topic(recording, options, file)
    skips = Skips(file, options.strict, place="message")
    findings = Findings(skips, recording.listed(), recording.warnings)
    findings.used = {"laser": choice.why, "checksums": recording.checksums}
    findings.lasers, findings.laser_option = tuple(devices(recording, SCANS)), "--topic"
    findings.odometries = tuple(devices(recording, ODOMETRY))
    sweeps, messages = _sweeps(recording.messages.get(choice.topic, []), choice.topic, skips, file)
    stamps = stamps_set([sweep.stamp for sweep in sweeps])
    header_time = is_clock(stamps)
    if not header_time:
        findings.warnings.append("the scans' own time stamps say nothing: the times of recording are used")
        stamps = [message.log_time for message in messages]
    raw = _raw(sweeps, [_written(stamp) for stamp in stamps])
    times = order.by_time(raw.stamps)
    findings.warnings += times.warnings
    frames = Transforms(recording, skips, file)
    motion = recorded_motion.robot_odometry(recording, frames, times, header_time, options, findings, file)
    mount, hanging, robot = mounting(sweeps, motion.robot, frames, options, findings, file)
    findings.frames = frame_names(sweeps[0].frame, robot, motion.parent, mount)
    if hanging and not options.flip:
        # Seen from above, the beams of a laser that hangs run clockwise.
        raw = raw.mirrored()
    return laser_log(
        source,
        recording.form,
        choice.topic,
        raw,
        times,
        mount,
        RecordedMotion(motion.poses),
        findings,
        options,
        file,
    )


def _sweeps(
    messages: Sequence[Message], topic: str, skips: Skips, file: str
) -> tuple[list[Sweep], list[Message]]:
    """The scans that can be decoded, of one frame, and their messages."""
    decoders = {channel: sweep_decoder(channel, file) for channel in _channels(messages)}
    sweeps, kept = [], []
    frame = None
    for number, message in enumerate(messages, 1):
        try:
            sweep = decoders[message.channel](message.data)
            problem = _problem(sweep)
        except UNDECODABLE:
            problem = f"{topic}: cannot be decoded"
        if not problem and frame not in (None, sweep.frame):
            problem = f"{topic}: a scan in another frame than {frame}"
        if problem:
            skips.add(problem, number)
            continue
        frame = sweep.frame
        sweeps.append(sweep)
        kept.append(message)
    if not sweeps:
        reason = next(iter(skips.reasons), "there is none")
        raise InputDataError(file, f"no scan of {topic} can be read: {reason}",
                             "give a recording with whole messages")  # fmt: skip
    return sweeps, kept


def _channels(messages: Sequence[Message]) -> list[Channel]:
    return list(dict.fromkeys(message.channel for message in messages))


def _problem(sweep: Sweep) -> str:
    """What makes a scan unusable; empty when nothing does."""
    problem = beams_problem(len(sweep.ranges))
    turns = 4 * np.pi
    if not (abs(sweep.angle_min) <= turns and 0 < abs(sweep.angle_increment) <= turns):
        problem = problem or "an angle is out of bounds"
    return problem


def _written(stamp: int | None) -> str:
    return "" if stamp is None else f"{stamp // S}.{stamp % S:09d}"


def _raw(sweeps: Sequence[Sweep], stamps: list[str]) -> RawScans:
    """The scans as columns, with their own limits."""
    low, low_from = _limit("range_min", [sweep.range_min for sweep in sweeps], 0.0)
    high, high_from = _limit("range_max", [sweep.range_max for sweep in sweeps], FARTHEST)
    return RawScans(
        stacked([sweep.ranges for sweep in sweeps]),
        np.array([sweep.angle_min for sweep in sweeps], dtype=np.float64),
        np.array([sweep.angle_increment for sweep in sweeps], dtype=np.float64),
        stamps,
        # A reading at a limit counts (sensor_msgs/LaserScan); one at those of RawScans does not.
        (
            np.maximum(0.0, np.nextafter(low.astype(np.float32), np.float32(-1))),
            np.nextafter(high.astype(np.float32), np.float32(np.inf)),
        ),
        (low_from, high_from),
        angle_max=np.array([sweep.angle_max for sweep in sweeps], dtype=np.float64),
        beams=np.array([len(sweep.ranges) for sweep in sweeps], dtype=np.int64),
    )


def _limit(name: str, values: list[float], unsaid: float) -> tuple[Array, str]:
    """Limits (S,) where they say something, between 0 and FARTHEST, and where they are from."""
    found = np.array(values, dtype=np.float64)
    says = (found > 0) & (found < FARTHEST)
    return np.where(says, found, unsaid), f"{name} of the messages" if says.any() else "none in the messages"
