"""Files that say something wrong, each with what is wrong, the reference, and the words that tell the cause.

Those of NSCAN_DATA/strangers are there; their siblings are written on the fly from a simulated drive through
the office and from real logs.
"""

from __future__ import annotations

import functools
import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from nscan_cli.exports.carmen import corrected_log
from nscan_cli.graph.io.tum import parse_tum, write_tum
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.text.corrected_poses import OWN_HOST
from nscan_cli.poses import Array
from tests.logs.excerpts import truth_of
from tests.simulation import faults, odometry_faults
from tests.simulation.laser import Laser
from tests.simulation.reversing import there_and_back
from tests.simulation.scenes import office

Fault = Callable[[LaserLog], LaserLog]
SIMULATED = "office, simulated"
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
    for drive in (SIMULATED, "mit-csail", "fr079", "intel"):
        if drive != SIMULATED and not (data / f"{drive}.log.gz").exists():
            continue
        for fault, make, cause in FAULTS:
            if drive == SIMULATED or fault in FAULTS_OF_REAL_LOGS:
                files = partial(_sibling, data, drive, make)
                yield Case(drive, fault, cause, files, cure=KNOWN_CURES.get(fault, ""))
    for fault, form, cause in (
        ("", _with_angles, ""),
        ("FLASER, which has no angles", _without_angles, "541 beams over 270°"),
    ):
        yield Case(WIDE, fault, cause, partial(_wide, form))
    recording = data / "mit-csail.ros2.mcap"
    if recording.exists():
        for fault, first, last in (
            ("odometry ends at 150 s", 150.0, np.inf),
            ("no odometry, 100–250 s", 100.0, 250.0),
        ):
            yield Case("mit-csail", fault, "odometry is missing", partial(_with_gap, recording, first, last))


def _sibling(data: Path, drive: str, fault: Fault, folder: Path) -> tuple[Path, list[str]]:
    """A drive with a fault, as a file whose poses are its odometry."""
    log = fault(_simulated(ROUND_LASER) if drive == SIMULATED else _real(data / f"{drive}.log.gz"))
    path = folder / "sibling.log"
    path.write_bytes(_with_angles(log))
    if drive != SIMULATED:
        return path, ["--relations", str(data / f"{drive}.relations")]
    return path, _reference(log, folder)


def _wide(form: Callable[[LaserLog], bytes], folder: Path) -> tuple[Path, list[str]]:
    """The drive with a laser that CARMEN's older records have no angles for."""
    log, path = _simulated(WIDE_LASER), folder / "wide.log"
    path.write_bytes(form(log))
    return path, _reference(log, folder)


def _reference(log: LaserLog, folder: Path) -> list[str]:
    """The arguments of `evaluate` for the true poses, which are written to the folder."""
    truth = folder / "truth.tum"
    truth.write_bytes(write_tum(log.stamps, truth_of(log)))
    return ["--reference", str(truth)]


def _with_angles(log: LaserLog) -> bytes:
    """A log as CARMEN's newer records, whose poses are its odometry."""
    assert log.odometry is not None
    # By its host alone a reader would know that the poses may be no odometry.
    return corrected_log(log, np.arange(len(log)), log.odometry).replace(OWN_HOST, b"robot")


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


def _posts(*degrees: tuple[float, float, float]) -> Fault:
    sectors = [(np.radians(first), np.radians(last), distance) for first, last, distance in degrees]
    return lambda log: faults.own_parts(log, sectors)


def _frozen(log: LaserLog) -> LaserLog:
    return odometry_faults.turning(odometry_faults.scaled(log, 0.0), 0.0)


def _looking(degrees: float) -> Fault:
    """The file says that the laser looks so much further to the left than it does."""
    return lambda log: faults.mounted_otherwise(log, np.radians(degrees))


def _from_half_way(factor: float) -> Fault:
    """The second half of the scans has its ranges multiplied."""
    return lambda log: faults.ranges_scaled(log, factor, slice(len(log) // 2, None))


def _middle(log: LaserLog) -> slice:
    """The middle third of a log."""
    return slice(len(log) // 3, 2 * len(log) // 3)


FAULTS: tuple[tuple[str, Fault, str], ...] = (
    ("", lambda log: log, ""),
    ("odometry × 1000", lambda log: odometry_faults.scaled(log, 1000.0), "odometry-scale 0.001"),
    ("odometry × 1000 from half-way on",
        lambda log: odometry_faults.scaled_in(log, 1000.0, slice(len(log) // 2, None)),
        "in millimetres, elsewhere in metres",
    ),
    ("odometry × 300", lambda log: odometry_faults.scaled(log, 300.0), "odometry-scale 0.003"),
    ("odometry × 0.01", lambda log: odometry_faults.scaled(log, 0.01), "odometry-scale (100|9|10)"),
    ("odometry × 2", lambda log: odometry_faults.scaled(log, 2.0), "scale of odometry"),
    ("odometry × 0.5", lambda log: odometry_faults.scaled(log, 0.5), "scale of odometry"),
    ("odometry turns × 0.5", lambda log: odometry_faults.turning(log, 0.5), "odometry.* turns"),
    ("odometry turns × 1.6", lambda log: odometry_faults.turning(log, 1.6), "odometry.* turns"),
    ("odometry turns × −1", lambda log: odometry_faults.turning(log, -1.0), "turns the wrong way"),
    ("odometry's x reversed", odometry_faults.x_reversed, "odometry counts x or y the wrong way"),
    ("odometry backwards", odometry_faults.behind, "counts forward as backward"),
    ("odometry frozen", _frozen, "never moves"),
    ("odometry frozen for a third, then jumps",
        lambda log: odometry_faults.held(log, _middle(log), True),
        "odometry (does not move|never moves|stands still)",
    ),
    (
        "odometry frozen for a third",
        lambda log: odometry_faults.held(log, _middle(log), False),
        "odometry (does not move|never moves|stands still)",
    ),
    ("odometry without signs, three reversals",
        lambda log: odometry_faults.unsigned(there_and_back(log, [(40, 80), (200, 260), (270, 280)])),
        "counts reversing as driving forward",
    ),
    ("odometry × 1000 without signs, three reversals",
        lambda log: odometry_faults.scaled(
            odometry_faults.unsigned(there_and_back(log, [(40, 80), (200, 260), (270, 280)])), 1000.0
        ),
        "counts reversing as driving forward",
    ),
    ("each pose five times", lambda log: odometry_faults.repeated(log, 5), "odometry comes less often"),
    ("odometry zero at every 50th scan", lambda log: odometry_faults.zeros(log, 50), "single wrong values"),
    ("ranges in mm from half-way on", _from_half_way(1000.0), "in millimetres, the others in metres"),
    ("ranges in cm from half-way on", _from_half_way(100.0), "in centimetres, the others in metres"),
    ("ranges in feet from half-way on", _from_half_way(3.281), "all ranges are multiplied"),
    ("ranges × 1.15 from half-way on", _from_half_way(1.15), "change their scale from scan"),
    ("ranges × 0.9", lambda log: faults.ranges_scaled(log, 0.9, slice(None)), "range-scale 1.1"),
    ("readings reversed", faults.mirrored, "in the wrong order"),
    ("beams closer by a third", lambda log: faults.beams_apart(log, 2 / 3), "1° from beam to beam"),
    ("beams wider by a half", lambda log: faults.beams_apart(log, 1.5), "1° from beam to beam"),
    ("looks 90° left", _looking(-90.0), "90° further to the left"),
    ("looks 90° right", _looking(90.0), "(90|89|91)° further to the right"),
    ("looks back", _looking(180.0), "looks 180° further"),
    ("looks 30° left", _looking(-30.0), "(29|30|31)° further to the left"),
    ("odometry 30 s late", lambda log: odometry_faults.late(log, 30.0), "clock of odometry"),
    ("odometry 3 s early", lambda log: odometry_faults.late(log, -3.0), "clock of odometry"),
    ("odometry 1 s late", lambda log: odometry_faults.late(log, 1.0), "clock of odometry"),
    ("two posts of 10°", _posts((40.0, 50.0, 0.3), (-50.0, -40.0, 0.3)), "see the robot itself"),
    ("two posts of 20°", _posts((35.0, 55.0, 0.3), (-55.0, -35.0, 0.3)), "see the robot itself"),
    ("a wheel of 15° at 0.15 m", _posts((70.0, 85.0, 0.15)), "see the robot itself"),
    ("someone follows at 0.6 m", lambda log: faults.follower(log, 0.6), "goes along with the robot"),
    ("someone follows at 0.4 m", lambda log: faults.follower(log, 0.4), "goes along with the robot"),
    ("15 % of the readings are dust", lambda log: faults.dust(log, 0.15, 0.1), ""),
    ("cart on a hinge", faults.cart, "goes along with the robot"),
)  # fmt: skip
"""Name, fault, and what tells its cause."""
KNOWN_CURES = {
    "ranges × 0.9": r"--range-scale \S+",
    "ranges × 1.15 from half-way on": r"--end [\d.]+",
}
"""The options that the owner chooses where messages name several causes."""
FAULTS_OF_REAL_LOGS = (
    "", "two posts of 20°", "odometry × 1000", "odometry frozen for a third", "each pose five times",
)  # fmt: skip
"""Those that the real logs get: with all of them it takes an hour."""

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
