"""How late the odometry is against the scans of a laser that turns.

Tracking hardly notices a delay of a tenth of a second. But beams that were measured while the robot began to
turn would be corrected as if it stood, and the other way round.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nscan_cli.calibration.parabola import parabola_minimum
from nscan_cli.calibration.scan_motion import ScanMotion
from nscan_cli.calibration.scan_turns import scan_turns
from nscan_cli.calibration.sweep_options import SweepCheckOptions
from nscan_cli.logs.beam_times import BeamTimes
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.robot_path import RobotPath, poses_at, robot_path
from nscan_cli.poses import Array, Indices, are_known


def odometry_delay(log: LaserLog, motion: ScanMotion, options: SweepCheckOptions) -> float:
    """Seconds to add to the stamps of odometry, so that its turns fit best to those by scans; 0 in doubt.

    Rough turns are enough: matches of scans give the same to within a hundredth of a second.
    """
    path = log.odometry_path
    if log.odometry is None or path is None or log.beam_times is None:
        return 0.0
    rows = motion.spread_rows(options)
    turned = motion.rates(rows) * (log.times[rows + 1] - log.times[rows - 1])
    rows = rows[np.abs(turned) > options.min_winding]
    if len(rows) < options.few_delay_turns:
        return 0.0
    turned = _corrected_turns(motion, rows, log.beam_times, options)
    delay, gain = _best_delay(log, path, log.beam_times, rows, turned, options)
    return delay if len(rows) >= options.min_delay_turns or gain <= options.few_delay_gain else 0.0


def _corrected_turns(
    motion: ScanMotion, rows: Indices, beams: BeamTimes, options: SweepCheckOptions
) -> Array:
    """(n,) about how far (rad) the laser turns from the scan before each row to the one after it.

    Scans of fast turns, which these stretch, are seen as from their middle beams.
    """
    log, rates = motion.log, np.zeros(len(motion.log))
    some = np.unique(np.concatenate([rows - 1, rows + 1]))
    some = some[(some > 0) & (some < len(log) - 1)]
    rates[some] = motion.rates(some)
    stretch = np.broadcast_to(beams.step, len(log)) * rates
    stretch[np.abs(stretch) * 2 * np.pi <= options.corrected_winding * np.abs(log.angle_increment)] = 0.0
    begin = log.angle_min - 0.5 * (log.beam_counts() - 1) * stretch
    seen = replace(log, angle_min=begin, angle_increment=log.angle_increment + stretch)
    return scan_turns(seen, rows - 1, rows + 1, motion.turns)


def _best_delay(
    log: LaserLog, path: RobotPath, beams: BeamTimes, rows: Indices, turned: Array, options: SweepCheckOptions
) -> tuple[float, float]:
    """The delay (s) with which odometry disagrees least with the turns (n,) at rows (n,), 0 in doubt.

    Also returns the disagreement with it as a share of that without it.
    """
    # What a scan tells is where the robot is at its middle beam.
    middle = beams.first + 0.5 * (log.beam_counts() - 1) * beams.step
    begin, end = (log.times + middle)[rows - 1], (log.times + middle)[rows + 1]
    heading = np.unwrap(path.poses[:, 2])
    count = round(options.longest_delay / options.delay_step)
    delays = options.delay_step * np.arange(-count, count + 1, dtype=np.float64)
    by_odometry = np.interp(end - delays[:, None], path.times, heading)
    by_odometry -= np.interp(begin - delays[:, None], path.times, heading)
    off = np.minimum(np.abs(turned - by_odometry), options.largest_difference).mean(axis=1)
    best = int(np.argmin(off))
    gain = float(off[best] / off[count]) if off[count] > 0.0 else 1.0
    # At an end of the range the best one may lie beyond.
    if best in (0, 2 * count) or gain > options.delay_gain:
        return 0.0, gain
    delay = round(parabola_minimum(delays, off, options.delays_fitted), 3)
    return (delay if abs(delay) >= options.least_delay else 0.0), gain


def with_delay(log: LaserLog, delay: float) -> LaserLog:
    """The log with `delay` (s) added to the stamps of its odometry."""
    path, odometry = log.odometry_path, log.odometry
    if path is None or odometry is None:
        return log
    path = robot_path(path.times + delay, path.poses)
    if path is None:
        return log
    odometry = np.where(are_known(odometry)[:, None], poses_at(path, log.times), np.nan)
    return replace(log, odometry=odometry, odometry_path=path)
