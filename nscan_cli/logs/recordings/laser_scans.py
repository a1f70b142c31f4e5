"""A laser log from a recording: the scans of one topic, with odometry and mounting."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.provenance import Source
from nscan_cli.logs import scan_order as order
from nscan_cli.logs.assemble import ReaderFindings, RecordedMotion, laser_log
from nscan_cli.logs.copies import without_copies
from nscan_cli.logs.frame_names import distinct_frame_names
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.range_peaks import RangeLimitOptions
from nscan_cli.logs.raw_scans import RawScans, scan_table
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.recordings.alternating_lasers import first_of_two_lasers
from nscan_cli.logs.recordings.container import Message, Recording
from nscan_cli.logs.recordings.decoded_messages import S, ScanMessage, decimal_seconds
from nscan_cli.logs.recordings.decoding import decoded
from nscan_cli.logs.recordings.message_stamps import are_in_seconds, order_messages, valid_stamps
from nscan_cli.logs.recordings.message_types import ODOMETRY_TYPES, SCAN_TYPES
from nscan_cli.logs.recordings.mounting import laser_mounting
from nscan_cli.logs.recordings.robot_motion import ScanClock, robot_odometry
from nscan_cli.logs.recordings.sweep_segments import TimedScan, joined_sweeps
from nscan_cli.logs.recordings.tf_tree import TransformTree
from nscan_cli.logs.recordings.topics import devices, scan_topic
from nscan_cli.logs.skips import Skips
from nscan_cli.logs.sweep import RecordedSweep
from nscan_cli.logs.text.line_records import MAX_ANGLE, beams_problem
from nscan_cli.poses import Array


def log_from_recording(recording: Recording, file: str, source: Source, options: ReadingOptions) -> LaserLog:
    """The scans of one topic in order of time.

    Raises InputDataError when there are none, or the laser is tilted; WrongUsageError when the options do
    not fit the recording, or do not say which of several topics is meant.
    """
    if options.laser is not None:
        raise WrongUsageError(f"{file}: has topics, no lasers by tag; leave out --laser, see --topic")
    topic, why = scan_topic(recording, options, file)
    skips = Skips(file, options.strict, place="message")
    findings = ReaderFindings(skips, options, recording.topic_counts(), recording.warnings)
    findings.used = {"laser": why, "checksums": recording.checksums}
    findings.lasers, findings.laser_option = tuple(devices(recording, SCAN_TYPES)), "--topic"
    findings.odometries = tuple(devices(recording, ODOMETRY_TYPES))
    messages, twice = without_copies(recording.messages.get(topic, []), lambda each: each.data)
    findings.warnings += [twice] if twice else []
    scans, log_times = _decoded_scans(messages, topic, skips)
    stamps = valid_stamps([scan.stamp for scan in scans])
    use_stamps = order_messages(stamps) and are_in_seconds(stamps)
    if not use_stamps:
        findings.warnings.append("the scans' own time stamps are unusable: the times of recording are used")
        stamps = [*log_times]
    if not options.as_recorded:
        timed = [TimedScan(*one) for one in zip(scans, stamps, log_times, strict=True)]
        timed = _of_one_laser(timed, findings)
        scans, stamps, log_times = (list(column) for column in zip(*timed, strict=True))
    raw = _raw_scans(scans, [decimal_seconds(stamp) for stamp in stamps])
    times = order.scans_by_time(raw.stamps, raw.ranges)
    findings.warnings += times.warnings
    tree = TransformTree(recording, skips)
    clock = ScanClock(times, use_stamps, _recording_delay(stamps, log_times))
    motion = robot_odometry(tree, clock, findings)
    mount, hanging, robot = laser_mounting(scans, motion.robot, tree, findings)
    findings.frames = distinct_frame_names(scans[0].frame, robot, motion.parent, mount)
    if hanging and not options.flip:
        # Seen from above, the beams of a laser that is upside down run clockwise.
        raw = raw.mirrored()
    recorded = RecordedMotion(motion.poses, path=motion.path)
    return laser_log(source, recording.form, topic, raw, times, mount, recorded, findings)


def _of_one_laser(timed: Sequence[TimedScan], findings: ReaderFindings) -> list[TimedScan]:
    """The scans of one laser, each of a whole sweep."""
    turns, joined = joined_sweeps(timed)
    scans, left_out = first_of_two_lasers(turns)
    findings.contradictions += [said for said in (joined, left_out) if said]
    return scans


def _decoded_scans(
    messages: Sequence[Message], topic: str, skips: Skips
) -> tuple[list[ScanMessage], list[int]]:
    """The scans that can be decoded and share the frame of the first, and when they were recorded (ns)."""
    scans: list[ScanMessage] = []
    log_times: list[int] = []
    for number, log_time, scan in decoded(messages, topic, SCAN_TYPES, skips):
        problem = _scan_problem(scan)
        if not problem and scans and scan.frame != scans[0].frame:
            problem = f"{topic}: a scan in another frame than {scans[0].frame}"
        if problem:
            skips.add(problem, number)
        else:
            scans.append(scan)
            log_times.append(log_time)
    if not scans:
        problem = f"no scan of {topic} can be read: {next(iter(skips.reasons), 'there is none')}"
        raise InputDataError(skips.file, problem, "give a recording with whole messages")
    return scans, log_times


def _recording_delay(stamps: Sequence[int | None], log_times: Sequence[int]) -> float:
    """Median time from stamps (ns, None without one) to when the messages were recorded (ns), in s."""
    delays = [recorded - at for at, recorded in zip(stamps, log_times, strict=True) if at is not None]
    return float(np.median(delays)) / S


def _scan_problem(scan: ScanMessage) -> str:
    problem = beams_problem(len(scan.ranges))
    if not (abs(scan.angle_min) <= MAX_ANGLE and 0 < abs(scan.angle_increment) <= MAX_ANGLE):
        problem = problem or "an angle is out of bounds"
    return problem


def _raw_scans(scans: Sequence[ScanMessage], stamps: list[str]) -> RawScans:
    """The scans as columns, with the range limits of the messages."""
    low, low_from = _range_limit("range_min", [scan.range_min for scan in scans], 0.0)
    largest = RangeLimitOptions.largest_range
    high, high_from = _range_limit("range_max", [scan.range_max for scan in scans], largest)
    return RawScans(
        scan_table([scan.ranges for scan in scans]),
        np.array([scan.angle_min for scan in scans], dtype=np.float64),
        np.array([scan.angle_increment for scan in scans], dtype=np.float64),
        stamps,
        # A reading at a limit is valid in sensor_msgs/LaserScan, and is not in RawScans.
        (
            np.maximum(0.0, np.nextafter(low.astype(np.float32), np.float32(-1))),
            np.nextafter(high.astype(np.float32), np.float32(np.inf)),
        ),
        (low_from, high_from),
        angle_max=np.array([scan.angle_max for scan in scans], dtype=np.float64),
        beams=np.array([len(scan.ranges) for scan in scans], dtype=np.int64),
        recorded_sweep=RecordedSweep(
            np.array([scan.time_increment for scan in scans], dtype=np.float64),
            np.array([scan.scan_time for scan in scans], dtype=np.float64),
        ),
    )


def _range_limit(name: str, values: list[float], default: float) -> tuple[Array, str]:
    """The plausible limits (S,), `default` for others, and where they are from."""
    limits = np.array(values, dtype=np.float64)
    valid = (limits > 0) & (limits < RangeLimitOptions.largest_range)
    origin = f"{name} of the messages" if valid.any() else "none in the messages"
    return np.where(valid, limits, default), origin
