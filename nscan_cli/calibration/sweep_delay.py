"""How late the odometry is against the scans of a laser that turns, to a hundredth of a second.

Tracking hardly notices a delay of a tenth of a second. But beams that were measured while the robot began to
turn would be corrected as if it stood, and the other way round. odometry_delay.py finds longer delays with
any laser, by the steps of the check; clock_offset.py looks for two clocks that differ by up to two minutes.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.calibration.file_sweep import first_to_last, stamp_delays, usual_sweep_time
from nscan_cli.calibration.parabola import parabola_minimum
from nscan_cli.calibration.scan_motion import ScanMotion
from nscan_cli.calibration.sweep_options import SweepCheckOptions
from nscan_cli.calibration.turn_differences import turn_differences
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.robot_path import RobotPath
from nscan_cli.poses import Array, Indices


def sweep_delay(log: LaserLog, motion: ScanMotion, options: SweepCheckOptions) -> float:
    """Seconds to add to the stamps of odometry, so that its turns fit best to those by scans; 0 in doubt.

    Only a part of the scans in turns is matched if these fit hardly better with any delay.
    """
    path, measured = log.odometry_path, dict[int, float]()
    if log.odometry is None or path is None or log.beam_times is None:
        return 0.0
    rows, sweep, delay = _turning(motion, options), usual_sweep_time(log), 0.0
    for part in (rows[::4], rows[2::4], rows[1::2]):
        found = {row: motion.turned(row, sweep) for row in part}
        measured.update({row: turned for row, turned in found.items() if turned is not None})
        turns = np.array(list(measured.values()))
        count = np.count_nonzero(np.abs(turns) > options.min_winding)
        if count >= options.few_delay_turns:
            delay, gain = _best_delay(log, path, np.array(list(measured)), turns, options)
            if gain > options.no_delay_gain:
                return 0.0
            if count < options.min_delay_turns and gain > options.few_delay_gain:
                delay = 0.0
    return delay


def _best_delay(
    log: LaserLog, path: RobotPath, rows: Indices, turned: Array, options: SweepCheckOptions
) -> tuple[float, float]:
    """The delay (s) with which odometry disagrees least with the turns (n,) at rows (n,), 0 in doubt.

    It is that of scans stamped at another beam if this is near and fits as well: such a delay may be shorter
    than one that a clock is blamed for. Also returns the disagreement with the best delay as a share of that
    without it.
    """
    times, headings = log.middle_times, np.unwrap(path.poses[:, 2])
    count = round(options.longest_delay / options.delay_step)
    delays = options.delay_step * np.arange(-count, count + 1, dtype=np.float64)
    by_stamp = np.array(stamp_delays(log, log.reading.stamp))
    steps = times[rows - 1], times[rows + 1]
    tried = np.concatenate([delays, by_stamp])
    off = turn_differences((path.times, headings), steps, turned, tried).mean(axis=1)
    off, off_by_stamp = off[: len(delays)], off[len(delays) :]
    best = int(np.argmin(off))
    gain = float(off[best] / off[count]) if off[count] > 0.0 else 1.0
    # At an end of the range the best one may lie beyond.
    if best in (0, 2 * count) or gain > options.delay_gain:
        return 0.0, gain
    delay = round(parabola_minimum(delays, off, options.delays_fitted), 3)
    nearest = int(np.argmin(np.abs(by_stamp - delay)))
    is_near = abs(by_stamp[nearest] - delay) < 0.25 * first_to_last(log)
    if is_near and off_by_stamp[nearest] <= options.stamp_excess * off[best]:
        return float(by_stamp[nearest]), gain
    return (delay if abs(delay) >= options.least_delay else 0.0), gain


def _turning(motion: ScanMotion, options: SweepCheckOptions) -> list[int]:
    """Rows of scans in and beside turns, first those where their rate changes most: while the robot turns
    steadily, it turns as far at another time as well."""
    rows = _in_turns(motion.spread_rows(options, options.scans), motion, options)
    rows = rows[:: max(-(-len(rows) // options.max_delay_turns), 1)]
    rows = np.union1d(rows, motion.rows_beside(rows, options.scans_beside))
    rows = rows[(rows >= 2) & (rows <= len(motion.log) - 3)]
    changes = np.abs(motion.rates(rows + 1) - motion.rates(rows - 1))
    used: list[int] = rows[np.argsort(-changes, kind="stable")[: options.max_delay_turns]].tolist()
    return used


def _in_turns(rows: Indices, motion: ScanMotion, options: SweepCheckOptions) -> Indices:
    """Those of rows in which the robot turns."""
    turned = np.abs(motion.rates(rows)) * (motion.log.times[rows + 1] - motion.log.times[rows - 1])
    found: Indices = rows[turned > options.min_winding]
    return found
