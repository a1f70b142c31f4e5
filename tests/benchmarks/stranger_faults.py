"""Faults that are put into a simulated drive and into real logs, with the words that tell the cause."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from tests.simulation import faults, odometry_faults, things_beside
from tests.simulation.reversing import there_and_back
from tests.simulation.tilted_laser import tilted

Fault = Callable[[LaserLog], LaserLog]


def _posts(*degrees: tuple[float, float, float]) -> Fault:
    sectors = [(np.radians(first), np.radians(last), distance) for first, last, distance in degrees]
    return lambda log: things_beside.own_parts(log, sectors)


def _frozen(log: LaserLog) -> LaserLog:
    return odometry_faults.turning(odometry_faults.scaled(log, 0.0), 0.0)


def _looking(degrees: float) -> Fault:
    """The file says that the laser looks so much further to the left than it does."""
    return lambda log: faults.mounted_otherwise(log, np.radians(degrees))


def _from_half_way(factor: float) -> Fault:
    """The second half of the scans has its ranges multiplied."""
    return lambda log: faults.ranges_scaled(log, factor, slice(len(log) // 2, None))


def _turned_from_half_way(degrees: float) -> Fault:
    """The second half of the scans has its bearings counted from elsewhere."""
    return lambda log: faults.turned_in(log, np.radians(degrees), slice(len(log) // 2, None))


def _turned_on_robot(log: LaserLog, turn: float) -> LaserLog:
    """A laser that sees all around is turned (rad) in the middle third, and the file does not know."""
    ranges, rows = log.ranges.copy(), _middle(log)
    beams = round(turn / float(log.angle_increment[0]))
    ranges[rows] = np.roll(ranges[rows], beams, axis=1)
    return replace(log, ranges=ranges)


def _middle(log: LaserLog) -> slice:
    """The middle third of a log."""
    return slice(len(log) // 3, 2 * len(log) // 3)


JUMP_OF_RANGES = "times the others|odometry or the ranges change their scale"
JUMP_OF_ORDER = "in the other order than those of the others|order of the readings likely changes"
"""What tells such changes where the scans before and behind show them, or else odometry."""
JUMP_OF_DIRECTIONS = "see what those of the others see|if the laser did not change"
"""What tells changes that are in the file alone."""
FAULTS: tuple[tuple[str, Fault, str], ...] = (
    ("", lambda log: log, ""),
    ("odometry × 1000", lambda log: odometry_faults.scaled(log, 1000.0), "odometry-scale 0.001"),
    ("odometry × 1000 from half-way on",
        lambda log: odometry_faults.scaled_in(log, 1000.0, slice(len(log) // 2, None)),
        "in millimetres, elsewhere in metres",
    ),
    ("odometry × 0.3048", lambda log: odometry_faults.scaled(log, 0.3048), "odometry-scale 3"),
    ("odometry × 0.01", lambda log: odometry_faults.scaled(log, 0.01), "odometry-scale (100|9|10)"),
    ("odometry × 2", lambda log: odometry_faults.scaled(log, 2.0), "scale of odometry"),
    ("odometry × 0.5", lambda log: odometry_faults.scaled(log, 0.5), "scale of odometry"),
    ("odometry turns × 0.5", lambda log: odometry_faults.turning(log, 0.5), "odometry.* turns"),
    ("odometry turns × 1.6", lambda log: odometry_faults.turning(log, 1.6), "odometry.* turns"),
    ("odometry turns × −1", lambda log: odometry_faults.turning(log, -1.0), "turns the wrong way"),
    ("odometry's x reversed", odometry_faults.x_reversed, "odometry counts x or y the wrong way"),
    ("odometry heads 90° too far left",
        lambda log: odometry_faults.heading_elsewhere(log, np.radians(90.0)),
        "headings of odometry are",
    ),
    ("odometry backwards", odometry_faults.behind, "counts forward as backward"),
    ("odometry counts both wheels backward", odometry_faults.backward, "both wheels backward"),
    ("readings reversed, odometry backwards",
        lambda log: odometry_faults.behind(faults.mirrored(log)),
        "the readings are in the wrong order instead, and odometry counts forward as backward",
    ),
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
    ("position by odometry frozen from half-way on",
        lambda log: odometry_faults.partly_held(log, slice(len(log) // 2, None), slice(0, 2)),
        "stands still|contradicts the scans",
    ),
    ("heading by odometry frozen from half-way on",
        lambda log: odometry_faults.partly_held(log, slice(len(log) // 2, None), slice(2, 3)),
        "stands still",
    ),
    ("odometry without signs, three reversals",
        lambda log: odometry_faults.unsigned(there_and_back(log, [(40, 80), (200, 260), (270, 280)])),
        "counts reversing as driving forward",
    ),
    ("two drives in one file", faults.two_drives, "several drives in the log"),
    ("each pose five times", lambda log: odometry_faults.repeated(log, 5), "odometry comes less often"),
    ("odometry zero at every 50th scan", lambda log: odometry_faults.zeros(log, 50), "single wrong values"),
    ("noise of 0.5 m on odometry for 5 s, six times",
        lambda log: odometry_faults.noisy(log, 0.5, 0.0, 6, 5.0),
        "to and fro",
    ),
    ("noise of 0.2 m on odometry for 5 s, six times",
        lambda log: odometry_faults.noisy(log, 0.2, 0.0, 6, 5.0),
        "to and fro",
    ),
    ("noise of 20° on headings for 5 s, six times",
        lambda log: odometry_faults.noisy(log, 0.0, np.radians(20.0), 6, 5.0),
        "to and fro",
    ),
    ("twelve poses of odometry off by 0.5 to 3 m",
        lambda log: odometry_faults.astray(log, 0.5, 3.0, 12),
        "single wrong values",
    ),
    ("odometry of two nodes in turn",
        lambda log: odometry_faults.alternating(log, np.array([1.0, 2.0, np.radians(90.0)])),
        "two sources that alternate",
    ),
    ("coordinates by odometry wrap round at 8 m",
        lambda log: odometry_faults.wrapped(log, 8.0),
        "odometry jumps at",
    ),
    ("odometry jumps by 1.7 m in every 90th step",
        lambda log: odometry_faults.jumping(log, 90, np.array([1.5, 0.75, 0.0])),
        "odometry jumps at",
    ),
    ("two scans a stamp", lambda log: faults.shared_stamps(log, 2), "with the time stamp of the scan before"),
    ("stamps in ms", lambda log: faults.stamps_scaled(log, 1e3), "stamps are in milliseconds"),
    ("ranges in mm from half-way on", _from_half_way(1000.0), "in millimetres, the others in metres"),
    ("ranges in cm from half-way on", _from_half_way(100.0), "in centimetres, the others in metres"),
    ("ranges in feet from half-way on", _from_half_way(3.281), "all ranges are multiplied"),
    ("ranges × 1.1 from half-way on", _from_half_way(1.1), JUMP_OF_RANGES),
    ("ranges × 1.05 from half-way on", _from_half_way(1.05), JUMP_OF_RANGES),
    ("ranges × 0.9", lambda log: faults.ranges_scaled(log, 0.9, slice(None)), "range-scale 1.1"),
    ("ranges × 0.5", lambda log: faults.ranges_scaled(log, 0.5, slice(None)), "ranges, and so the size"),
    ("ranges × 25.4", lambda log: faults.ranges_scaled(log, 25.4, slice(None)), "millimetres taken for"),
    ("ranges rounded to 0.1 m", lambda log: faults.ranges_rounded(log, 0.1), "multiples of 0.1 m"),
    ("readings reversed", faults.mirrored, "in the wrong order"),
    ("readings reversed from half-way on",
        lambda log: faults.mirrored_in(log, slice(len(log) // 2, None)),
        JUMP_OF_ORDER,
    ),
    ("readings reversed in the last fifth",
        lambda log: faults.mirrored_in(log, slice(4 * len(log) // 5, None)),
        JUMP_OF_ORDER,
    ),
    ("looks 4° left from half-way on", _turned_from_half_way(4.0), JUMP_OF_DIRECTIONS),
    ("looks 30° left from half-way on", _turned_from_half_way(30.0), JUMP_OF_DIRECTIONS),
    ("looks 90° left from half-way on", _turned_from_half_way(90.0), JUMP_OF_DIRECTIONS),
    ("looks 90° left in the middle third",
        lambda log: faults.turned_in(log, 0.5 * np.pi, _middle(log)), JUMP_OF_DIRECTIONS,
    ),
    ("turned by 90° on the robot in the middle third",
        lambda log: _turned_on_robot(log, 0.5 * np.pi), "looks 90° further .* than elsewhere",
    ),
    ("turned by 180° on the robot in the middle third",
        lambda log: _turned_on_robot(log, np.pi), "looks 180° further .* than elsewhere",
    ),
    ("beams twice as far apart from half-way on",
        lambda log: faults.beams_apart(log, 2.0, slice(len(log) // 2, None)), JUMP_OF_DIRECTIONS,
    ),
    ("first directions jitter by 3°",
        lambda log: faults.first_directions_jitter(log, np.radians(3.0)),
        "looks the same way",
    ),
    ("beams closer by a third", lambda log: faults.beams_apart(log, 2 / 3), "1° from beam to beam"),
    ("beams wider by a half", lambda log: faults.beams_apart(log, 1.5), "1° from beam to beam"),
    ("beams wider by 10 %",
        lambda log: faults.beams_apart(log, 1.1),
        "walls are straight|as if it were one turn",
    ),
    ("beams wider by 1 %", lambda log: faults.beams_apart(log, 1.01), "as if it were one turn"),
    ("beams wider by 2 %",
        lambda log: faults.beams_apart(log, 1.02),
        "as if it were one turn|square to each other",
    ),
    ("halves of the scans exchanged",
        lambda log: replace(log, ranges=np.roll(log.ranges, log.ranges.shape[1] // 2, axis=1)),
        "begin in the middle of the scan|looks 180",
    ),
    ("beams wider by one in 360",
        lambda log: faults.beams_apart(log, 360 / 359),
        "as if it were one turn",
    ),
    ("angles in degrees", faults.angles_in_degrees, "angles of the beams are in degrees"),
    ("looks 90° left", _looking(-90.0), "90° further to the left"),
    ("looks back", _looking(180.0), "looks 180° further"),
    ("looks 30° left", _looking(-30.0), "(29|30|31)° further to the left"),
    ("odometry 30 s late", lambda log: odometry_faults.late(log, 30.0), "odometry is stamped"),
    ("odometry 3 s early", lambda log: odometry_faults.late(log, -3.0), "odometry is stamped"),
    ("odometry 1 s late", lambda log: odometry_faults.late(log, 1.0), "odometry is stamped"),
    ("two posts of 20°", _posts((35.0, 55.0, 0.3), (-55.0, -35.0, 0.3)), "see the robot itself"),
    ("a wheel of 15° at 0.15 m", _posts((70.0, 85.0, 0.15)), "see the robot itself"),
    ("a sixth of the beams always says 5 m", lambda log: faults.dead_beams(log, 5.0), "exactly the same"),
    ("tilted, sees the floor 3 m ahead", lambda log: tilted(log, 3.0), "tilted and sees the floor"),
    ("someone follows at 0.6 m", lambda log: things_beside.follower(log, 0.6), "goes along with the robot"),
    ("someone leads at 0.6 m", lambda log: things_beside.leader(log, 0.6), "goes along with the robot"),
    ("the laser sees nothing for a tenth",
        lambda log: faults.without_returns(log, slice(len(log) // 2, 6 * len(log) // 10), 0.0),
        "sees nothing",
    ),
    ("nothing in range from half-way on",
        lambda log: faults.without_returns(log, slice(len(log) // 2, None)),
        "sees nothing",
    ),
    ("15 % of the readings are dust", lambda log: faults.dust(log, 0.15, 0.1), "stands? for no reading"),
    ("20 % of the readings say 2 m", lambda log: faults.dust(log, 0.2, 2.0), "stands? for no reading"),
    ("noise of 0.1 m on the ranges", lambda log: faults.noisy_ranges(log, 0.1), "beside each other scatter"),
    ("cart on a hinge", things_beside.cart, "goes along with the robot"),
)  # fmt: skip
"""Name, fault, and what tells its cause."""
KNOWN_CURES = {
    "odometry heads 90° too far left": "--no-odometry",
    "ranges × 0.9": r"--range-scale \S+",
    "ranges × 1.1 from half-way on": r"--range-scale [\d.]+|--end [\d.]+",
    "ranges × 1.05 from half-way on": r"--range-scale [\d.]+|--end [\d.]+",
}
"""The options that the owner chooses where messages name several causes."""
FAULTS_OF_REAL_LOGS = (
    "", "someone leads at 0.6 m", "heading by odometry frozen from half-way on",
    "two posts of 20°", "a sixth of the beams always says 5 m", "tilted, sees the floor 3 m ahead",
    "odometry × 1000", "odometry turns × −1", "odometry heads 90° too far left",
    "odometry frozen for a third", "each pose five times", "odometry zero at every 50th scan",
    "ranges rounded to 0.1 m", "first directions jitter by 3°", "two drives in one file",
    "noise of 0.5 m on odometry for 5 s, six times", "twelve poses of odometry off by 0.5 to 3 m",
    "odometry of two nodes in turn", "coordinates by odometry wrap round at 8 m",
    "odometry jumps by 1.7 m in every 90th step", "halves of the scans exchanged",
    "two scans a stamp", "stamps in ms", "ranges × 1.1 from half-way on",
    "ranges × 1.05 from half-way on", "readings reversed", "readings reversed from half-way on",
    "readings reversed in the last fifth", "looks 90° left in the middle third", "beams wider by 10 %",
    "beams wider by 2 %", "20 % of the readings say 2 m", "noise of 0.1 m on the ranges",
)  # fmt: skip
"""Those that the real logs get: with all of them it takes an hour."""
FAULTS_OUTDOORS = (
    "", "odometry × 1000", "odometry × 2", "odometry turns × −1", "odometry heads 90° too far left",
    "odometry backwards", "odometry frozen for a third", "readings reversed", "looks 90° left", "looks back",
)  # fmt: skip
"""Those that fr-campus gets: where its odometry is believed and wrong, places are searched for minutes."""
