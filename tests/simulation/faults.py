"""What goes wrong with a robot and its sensors, put into a log that was recorded without trouble.

Every function takes a log and gives another, with the same scans but for the trouble; true poses stay true.
Rows are positions in the log; `rows` is any slice or array of them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.scan_order import by_time
from nscan_cli.poses import compose, relative
from tests.logs.excerpts import Rows, excerpt, truth_of


def taken(log: LaserLog, rows: Rows) -> LaserLog:
    """The scans in `rows` alone, in that order, numbered like a log that never had others."""
    part = excerpt(log, rows)
    return replace(part, numbers=np.arange(len(part)))


def without_returns(log: LaserLog, rows: Rows, reading: float = np.inf) -> LaserLog:
    """No beam comes back: inf is "nothing met", nan "nothing said"."""
    ranges = log.ranges.copy()
    ranges[rows] = reading
    return replace(log, ranges=ranges)


def glass(log: LaserLog, x: tuple[float, float], y: tuple[float, float], angle: float) -> LaserLog:
    """Walls within a box of the floor plan reflect beams near to head-on only (to `angle`, rad).

    The walls lie along x or y, whichever the box is longer in. The other beams go through, and nothing
    behind the glass is near.
    """
    ranges, truth = log.ranges.copy(), truth_of(log)
    along = 0 if x[1] - x[0] > y[1] - y[0] else 1
    for row in range(len(log)):
        beams = log.angle_min[row] + log.angle_increment[row] * np.arange(ranges.shape[1])
        laser = log.laser_pose(truth[row])
        directions = laser[2] + beams
        reached = np.nan_to_num(ranges[row], nan=0.0, posinf=1e3)
        ends = laser[:2] + reached[:, None] * np.stack([np.cos(directions), np.sin(directions)], axis=-1)
        within = (ends[:, 0] > x[0]) & (ends[:, 0] < x[1]) & (ends[:, 1] > y[0]) & (ends[:, 1] < y[1])
        normal = np.abs(np.sin(directions) if along == 0 else np.cos(directions))
        ranges[row, within & (np.arccos(np.clip(normal, 0, 1)) > angle)] = np.inf
    return replace(log, ranges=ranges)


def dropped(log: LaserLog, rows: Rows) -> LaserLog:
    """Scans are missing; the odometry of those behind knows of the way."""
    return taken(log, np.delete(np.arange(len(log)), rows))


def carried(log: LaserLog, rows: Rows) -> LaserLog:
    """Someone lifts the robot at the first of `rows` and puts it down behind the last.

    Nothing was recorded meanwhile, and the wheels did not turn.
    """
    some = np.arange(len(log))[rows]
    return spliced([taken(log, slice(0, int(some[0]))), taken(log, slice(int(some[-1]) + 1, None))])


def spliced(parts: list[LaserLog], pause: float = 5.0) -> LaserLog:
    """Drives one after the other as one log: between two the robot is carried, in `pause` seconds.

    The odometry of each goes on where that of the one before ended.
    """
    times, odometry = [parts[0].times], [parts[0].odometry]
    for part in parts[1:]:
        times.append(times[-1][-1] + pause + part.times - part.times[0])
        before, own = odometry[-1], part.odometry
        if before is None or own is None:
            odometry.append(None)
        else:
            odometry.append(compose(before[-1], relative(own, own[0])))
    known = [poses for poses in odometry if poses is not None]
    together = np.concatenate(times)
    return replace(
        parts[0],
        numbers=np.arange(len(together)),
        stamps=tuple(f"{time:.6f}" for time in together),
        times=together,
        ranges=np.concatenate([part.ranges for part in parts]),
        angle_min=np.concatenate([part.angle_min for part in parts]),
        angle_increment=np.concatenate([part.angle_increment for part in parts]),
        odometry=np.concatenate(known) if len(known) == len(parts) else None,
        truth_times=None if parts[0].truth is None else together,
        truth=None if parts[0].truth is None else np.concatenate([truth_of(part) for part in parts]),
    )


def two_drives(log: LaserLog, begin: float = 0.3) -> LaserLog:
    """The first 60 % of a drive, and its last part from `begin` (share of it) on, as two drives.

    The odometry of each begins at zero.
    """
    rows = len(log)
    parts = [taken(log, slice(0, 6 * rows // 10)), taken(log, slice(int(begin * rows), None))]
    both, at = spliced(parts), len(parts[0])
    odometry = both.odometry
    assert odometry is not None
    each = [relative(poses, poses[0]) for poses in (odometry[:at], odometry[at:])]
    return replace(both, odometry=np.concatenate(each))


def frozen(log: LaserLog, rows: Rows) -> LaserLog:
    """The laser repeats its reading before the first of `rows`, while the robot drives on."""
    some, ranges = np.arange(len(log))[rows], log.ranges.copy()
    ranges[some] = ranges[some[0] - 1]
    return replace(log, ranges=ranges)


def ranges_scaled(log: LaserLog, factor: float, rows: Rows) -> LaserLog:
    """Some scans are in another unit."""
    ranges = log.ranges.copy()
    ranges[rows] *= np.float32(factor)
    return replace(log, ranges=ranges)


def ranges_rounded(log: LaserLog, step: float) -> LaserLog:
    """All ranges as multiples of a step (m)."""
    return replace(log, ranges=np.float32(step) * np.round(log.ranges / np.float32(step)))


def noisy_ranges(log: LaserLog, sigma: float, seed: int = 1) -> LaserLog:
    """Noise of this standard deviation (m) on all ranges."""
    noise = np.random.default_rng(seed).normal(0.0, sigma, log.ranges.shape)
    return replace(log, ranges=np.maximum(log.ranges + noise, 0.0).astype(np.float32))


def dust(log: LaserLog, share: float, reading: float) -> LaserLog:
    """A share of the beams, each by chance, ends at one reading (m)."""
    ranges = log.ranges.copy()
    ranges[np.random.default_rng(7).random(ranges.shape) < share] = reading
    return replace(log, ranges=ranges)


def mirrored(log: LaserLog) -> LaserLog:
    """The readings of each scan in the wrong order."""
    return mirrored_in(log, slice(None))


def mirrored_in(log: LaserLog, rows: Rows) -> LaserLog:
    """The readings of some scans in the wrong order."""
    first, between = log.angle_min.copy(), log.angle_increment.copy()
    first[rows] *= -1.0
    between[rows] *= -1.0
    return replace(log, angle_min=first, angle_increment=between)


def turned_in(log: LaserLog, turn: float, rows: Rows) -> LaserLog:
    """The bearings of some scans are too large by a turn (rad)."""
    first = log.angle_min.copy()
    first[rows] += turn
    return replace(log, angle_min=first)


def first_directions_jitter(log: LaserLog, sigma: float, seed: int = 1) -> LaserLog:
    """The file has first directions that are off by chance, with this standard deviation (rad)."""
    jitter = sigma * np.random.default_rng(seed).standard_normal(len(log))
    return replace(log, angle_min=log.angle_min + jitter)


def beams_apart(log: LaserLog, factor: float, rows: Rows = slice(None)) -> LaserLog:
    """The file says that beams are so many times as far apart as they are, about the same middle."""
    middle, step = (
        log.angle_min + 0.5 * log.angle_increment * (log.beam_counts() - 1),
        log.angle_increment.copy(),
    )
    step[rows] *= factor
    return replace(log, angle_min=middle - 0.5 * step * (log.beam_counts() - 1), angle_increment=step)


def angles_in_degrees(log: LaserLog) -> LaserLog:
    """The file has first directions and steps in degrees."""
    return replace(log, angle_min=np.degrees(log.angle_min), angle_increment=np.degrees(log.angle_increment))


def mounted_otherwise(log: LaserLog, turn: float) -> LaserLog:
    """The file says that the laser looks further to the left than it does, by a turn (rad)."""
    return replace(log, mount=log.mount + np.array([0.0, 0.0, turn]))


def clock_jump(log: LaserLog, at: int, seconds: float) -> LaserLog:
    """The clock is set by so much at row `at`; the log is read as any other, in the order of its stamps."""
    times = log.times.copy()
    times[at:] += seconds
    order = by_time([f"{time:.6f}" for time in times])
    return replace(taken(log, order.rows), stamps=tuple(order.stamps), times=order.times)


def shared_stamps(log: LaserLog, count: int) -> LaserLog:
    """So many successive scans have the stamp of the first of them; they are true at their own times."""
    stamps = tuple(log.stamps[row // count * count] for row in range(len(log)))
    return replace(log, stamps=stamps, times=np.array([float(stamp) for stamp in stamps]))


def stamps_scaled(log: LaserLog, per_second: float) -> LaserLog:
    """The stamps in another unit, so many to a second; the scans are true at their own times."""
    return replace(log, stamps=tuple(f"{time * per_second:.0f}" for time in log.times))


def dead_beams(log: LaserLog, reading: float) -> LaserLog:
    """A sixth of the beams, those next to the first sixth, always says one reading (m)."""
    ranges, sixth = log.ranges.copy(), log.ranges.shape[1] // 6
    ranges[:, sixth : 2 * sixth] = reading
    return replace(log, ranges=ranges)
