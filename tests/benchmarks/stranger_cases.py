"""Files that say something wrong, each with what is wrong, the reference, and the words that tell the cause.

Those of NSCAN_DATA/strangers are there; their siblings are written on the fly from a simulated drive through
the office and from real logs.
"""

from __future__ import annotations

import functools
import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from nscan_cli import build_graph
from nscan_cli.exports.carmen import corrected_log
from nscan_cli.graph.io.tum import parse_tum, write_tum
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.text.corrected_poses import OWN_HOST
from nscan_cli.poses import Array
from tests.benchmarks.stranger_faults import (
    FAULTS,
    FAULTS_OF_REAL_LOGS,
    FAULTS_OUTDOORS,
    KNOWN_CURES,
    Fault,
)
from tests.logs.excerpts import truth_of
from tests.simulation.laser import Laser
from tests.simulation.scenes import office

SIMULATED, CAMPUS, URG = "office, simulated", "fr-campus", "urg-corridor-1"
OWN_REPEATABILITY = 0.02
"""m; RMSE between maps of all scans and of every third one of the drive whose truth is its own map."""
WIDE = "office, 541 beams over 270°"
WIDE_LASER = Laser(541, np.radians(-135.0), np.radians(0.5), 20.0, no_return=81.0, mount=(0.2, 0.0, 0.0))
ROUND_LASER = Laser(360, -np.pi, np.radians(1.0), 12.0, no_return=13.0, mount=(0.2, 0.0, 0.0))


@dataclass(frozen=True)
class Case:
    """One file."""

    drive: str
    """What was driven: cases with the same name have the same error if nothing is wrong."""
    fault: str
    """What is wrong with the file; empty for nothing."""
    cause: str
    """Regular expression of what a message says that tells the cause; empty where none has to be told."""
    files: Callable[[Path], tuple[Path, list[str]]]
    """The log, and the arguments of `evaluate`; what is not there is written to an empty folder."""
    untouched: float | None = None
    """Error (m) of the drive if nothing is wrong; None: that of the case without a fault."""
    cure: str = ""
    """Regular expression of the option, of several, that the owner of the file knows to be right; empty: the
    first one."""


def strangers(data: Path) -> Iterator[Case]:
    """The recordings of the data."""
    there = data / "strangers"
    for name, fault, cause, truth, untouched in STRANGERS:
        if (there / name).exists():
            files = partial(_stranger, there / name, there / truth)
            yield Case(name, fault, cause, files, untouched)


def _stranger(log: Path, truth: Path, folder: Path) -> tuple[Path, list[str]]:
    if log.name == "two-clocks.mcap":
        # Its scans have stamps of another clock than the truth.
        poses, truth = parse_tum(truth.read_bytes(), truth.name).poses, folder / "truth.tum"
        truth.write_bytes(write_tum(read_log(str(log)).stamps, poses))
    return log, ["--reference", str(truth)]


def siblings(data: Path) -> Iterator[Case]:
    """The faults on a simulated drive and on real logs."""
    for drive in (SIMULATED, "mit-csail", "fr079", "intel", CAMPUS, URG):
        if drive != SIMULATED and not _recording(data, drive).exists():
            continue
        untouched = OWN_REPEATABILITY if drive == URG else None
        for fault, make, cause in FAULTS:
            if drive == SIMULATED or fault in (FAULTS_OUTDOORS if drive == CAMPUS else FAULTS_OF_REAL_LOGS):
                files = partial(_sibling, data, drive, make)
                yield Case(drive, fault, cause, files, untouched, KNOWN_CURES.get(fault, ""))
    for fault, form, cause in (
        ("", with_own_angles, ""),
        ("FLASER, which has no angles", _without_angles, "541 beams over 270°"),
        ("headings in degrees", _headings_in_degrees, "headings of odometry are in degrees"),
    ):
        yield Case(WIDE, fault, cause, partial(_wide, form))
    for drive in ("mit-csail", "fr079", "intel"):
        if _recording(data, drive).exists():
            files = partial(_in_degrees, _recording(data, drive))
            yield Case(drive, "headings in degrees", "headings of odometry are in degrees", files)
    recording = data / "mit-csail.ros2.mcap"
    if recording.exists():
        for fault, first, last in (
            ("odometry ends at 150 s", 150.0, np.inf),
            ("no odometry, 100–250 s", 100.0, 250.0),
        ):
            yield Case("mit-csail", fault, "odometry is missing", partial(_with_gap, recording, first, last))


def _sibling(data: Path, drive: str, fault: Fault, folder: Path) -> tuple[Path, list[str]]:
    """A drive with a fault, as a file whose poses are its odometry."""
    if drive == SIMULATED:
        log = _simulated(ROUND_LASER)
    else:
        log = (_with_own_map if drive == URG else _real)(_recording(data, drive))
    log, path = fault(log), folder / "sibling.log"
    path.write_bytes(with_own_angles(log))
    if log.truth is not None:
        return path, _reference(log, folder)
    relations = data / f"{drive}.relations"
    if relations.exists():
        return path, ["--relations", str(relations)]
    return path, ["--reference", str(data / f"{drive}.reference.tum")]


def _recording(data: Path, drive: str) -> Path:
    """The file of a real drive."""
    return data / "field" / f"{drive}.bag" if drive == URG else data / f"{drive}.log.gz"


def _wide(form: Callable[[LaserLog], bytes], folder: Path) -> tuple[Path, list[str]]:
    """The drive with a laser that CARMEN's older records have no angles for."""
    log, path = _simulated(WIDE_LASER), folder / "wide.log"
    path.write_bytes(form(log))
    return path, _reference(log, folder)


def _reference(log: LaserLog, folder: Path) -> list[str]:
    """The arguments of `evaluate` for the true poses, which are written to the folder."""
    truth = folder / "truth.tum"
    assert log.truth_times is not None
    # The stamps of the file may be wrong.
    stamps = [f"{time:.6f}" for time in log.truth_times]
    truth.write_bytes(write_tum(stamps, truth_of(log)))
    return ["--reference", str(truth)]


def with_own_angles(log: LaserLog) -> bytes:
    """A log as CARMEN's newer records, whose poses are its odometry."""
    assert log.odometry is not None
    # By its host alone a reader would know that the poses may be no odometry.
    return corrected_log(log, np.arange(len(log)), log.odometry).replace(OWN_HOST, b"robot")


def _headings_in_degrees(log: LaserLog) -> bytes:
    """A log whose poses have headings in degrees."""
    lines = [line.split(b" ") for line in with_own_angles(log).split(b"\n")]
    for line in lines:
        # Behind the poses of laser and robot are so many values.
        behind = {b"ROBOTLASER1": 8, b"FLASER": 3}.get(line[0])
        if behind is not None:
            for place in (-behind - 4, -behind - 1):
                line[place] = f"{np.degrees(float(line[place])):.6f}".encode()
    return b"\n".join(b" ".join(line) for line in lines)


def _in_degrees(log: Path, folder: Path) -> tuple[Path, list[str]]:
    """A real log with such headings."""
    path = folder / "degrees.log"
    path.write_bytes(_headings_in_degrees(_real(log)))
    return path, ["--relations", str(log.with_name(log.name.replace(".log.gz", ".relations")))]


def _without_angles(log: LaserLog) -> bytes:
    """A log as CARMEN's older records, which have readings and poses alone."""
    assert log.odometry is not None
    readings = np.where(np.isfinite(log.ranges), log.ranges, WIDE_LASER.no_return)
    poses = zip(log.laser_pose(log.odometry), log.odometry, strict=True)
    lines = [
        f"FLASER {len(scan)} {_text(scan)} {_text(laser)} {_text(robot)} {time:.6f} robot {time:.6f}\n"
        for scan, (laser, robot), time in zip(readings, poses, log.times, strict=True)
    ]
    return "".join(lines).encode()


def _text(values: Array) -> str:
    return " ".join(f"{value:.6f}" for value in values)


def _with_gap(recording: Path, first: float, last: float, folder: Path) -> tuple[Path, list[str]]:
    path = folder / recording.name
    path.write_bytes(_without_odometry(recording.read_bytes(), first, last))
    return path, ["--relations", str(recording.parent / "mit-csail.relations")]


@functools.cache
def _real(path: Path) -> LaserLog:
    return read_log(str(path))


@functools.cache
def _with_own_map(path: Path) -> LaserLog:
    """A drive that no reference knows, as a text log has it: the truth is its own map."""
    log = replace(read_log(str(path)), beam_times=None, path=None, odometry_path=None)
    with TemporaryDirectory() as folder:
        Path(folder, "own.log").write_bytes(with_own_angles(log))
        truth = build_graph(read_log(str(Path(folder, "own.log")))).poses
    return replace(log, truth_times=log.times, truth=truth)


@functools.cache
def _simulated(laser: Laser) -> LaserLog:
    scene = office()
    return scene.record_at(scene.truth()[:600], 7, laser).log()


def _without_odometry(recording: bytes, first: float, last: float) -> bytes:
    """A recording (MCAP) without the odometry from one time after its first message to another, s."""
    from mcap.reader import make_reader
    from mcap.writer import Writer

    out, channels, begin = io.BytesIO(), dict[int, int](), None
    writer = Writer(out)
    writer.start(profile="ros2")
    for schema, channel, message in make_reader(io.BytesIO(recording)).iter_messages():
        begin = message.log_time if begin is None else begin
        if "odom" in channel.topic and first <= 1e-9 * (message.log_time - begin) < last:
            continue
        if channel.id not in channels:
            assert schema is not None
            number = writer.register_schema(schema.name, schema.encoding, schema.data)
            channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, number)
        writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time)
    writer.finish()  # type: ignore[no-untyped-call]
    return out.getvalue()


STRANGERS: tuple[tuple[str, str, str, str, float], ...] = (
    ("mirrored.mcap", "readings reversed", "in the wrong order", "office-900.tum", 0.0027),
    ("mount-wrong-90.mcap", "looks 90° left", "90° further to the left", "office-600.tum", 0.0014),
    ("contradict.mcap", "angle_max contradicts angle_increment", "angle_max.* but", "office-400.tum", 0.0016),
    ("two-clocks.mcap", "two clocks", "stamped by two clocks", "office-400.tum", 0.0016),
    ("odometry-millimetres.mcap", "odometry in mm", "odometry-scale 0.001", "office-900.tum", 0.0027),
    ("odometry-frozen.mcap", "odometry frozen", "never moves", "office-900.tum", 0.0137),
    ("odometry-gap.mcap", "no odometry for 500 scans", "odometry is missing", "office-900.tum", 0.0137),
    ("corridor-odometry-ends.mcap", "odometry ends half-way", "odometry is missing", "corridor.tum", 0.0027),
    ("posts.mcap", "four posts of 4°", "see the robot itself", "office-900.tum", 0.0027),
    ("shadow.mcap", "four posts of 20°", "see the robot itself", "office-900.tum", 0.0027),
    ("two-lasers-one-frame.mcap", "two lasers, one frame", "two lasers alternate", "office-600.tum", 0.0014),
    ("segments.mcap", "a turn in six messages", "comes in 6 messages", "office-600.tum", 0.0014),
    ("moving-tf.mcap", "base_link rocks", "", "office-600.tum", 0.0014),
    ("millimetres.mcap", "ranges in mm", "looks like millimetres", "office-400.tum", 0.0016),
    ("atmax.mcap", "range_max is nothing", "", "office-400.tum", 0.0016),
    ("unmerged.db3", "half in the write-ahead log", "", "office-400.tum", 0.0016),
    ("sweep-office.mcap", "a turn takes 0.1 s", "", "sweep-office.tum", 0.0018),
)  # fmt: skip
"""Name, fault, what tells its cause, truth, and error of the untouched drive (m)."""
