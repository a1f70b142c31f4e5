"""Export of a log with corrected poses as CARMEN text, as the relations metric and other tools read it.

Laser records carry two poses: that of the laser, then that of the robot (CARMEN, src/logger/writelog.c). Both
are corrected here. The time stamps are those of the source, so that tools find the same scans by them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from nscan_cli.files.finite import check_finite
from nscan_cli.logs.laser_defaults import CARMEN_MAX_RANGE, beam_angles
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.seen_at_once import seen_at_once
from nscan_cli.logs.text.corrected_poses import OWN_HOST
from nscan_cli.poses import Array, Indices, wrap

HEADER = """\
# CARMEN Logfile
# the poses are corrected ones, a result of nscan-cli, and no odometry
"""
ANGLE_TOLERANCE = 1e-6
"""Beam directions that differ by less count as equal, rad."""


def corrected_log(log: LaserLog, rows: Indices, poses: Array) -> bytes:
    """The scans in `rows` (N,) of a log as CARMEN text, taken at the robot's `poses` (N, 3).

    The records are FLASER where the beams have the directions that CARMEN assumes for their number and end
    within CARMEN's largest range. Otherwise they are ROBOTLASER1, which states both. A beam without return
    gets the least range that means so in the log (PARAM robot_front_laser_max), an invalid one 0. Ranges keep
    all digits and poses 9 decimals, so that reading gives the same values. A laser that turns is written as
    if it saw at once, since the records have no times of beams. Raises NotFiniteError.
    """
    check_finite("the corrected poses", poses)
    log = seen_at_once(log.moving_along(poses, rows))
    ranges = log.ranges[rows]
    greatest = ranges[np.isfinite(ranges)].max(initial=np.float32(0.0))
    limit = _no_return_limit(log, float(greatest))
    nothing = limit if log.no_return is None else max(np.float32(log.no_return), limit)
    first, step = log.angle_min[rows], log.angle_increment[rows]
    own = log.beam_counts()[rows]
    plain = greatest < CARMEN_MAX_RANGE and _has_carmen_angles(first, step, own)
    lines = [HEADER, *_param_lines(log, limit, float(step[0]))]
    lasers = log.laser_pose(poses)
    since = log.times - log.times[0]
    beams = _beam_texts(ranges, own, nothing)
    for k, row in enumerate(rows.tolist()):
        triples = f"{_pose_fields(lasers[k])} {_pose_fields(poses[k])}"
        end = f"{log.stamps[row]} {OWN_HOST.decode()} {since[row]:.6f}\n"
        if plain:
            lines.append(f"FLASER {next(beams)} {triples} {end}")
        else:
            fov = step[k] * (own[k] - 1)
            head = f"0 {float(first[k])!r} {float(fov)!r} {float(step[k])!r} {limit!s} 0 0"
            lines.append(f"ROBOTLASER1 {head} {next(beams)} 0 {triples} 0 0 0 0 0 {end}")
    return "".join(lines).encode()


def _no_return_limit(log: LaserLog, greatest: float) -> np.float32:
    """The range (m) from which on a beam has no return; without a limit in the log, one that fits."""
    limit = log.range_limits[1]
    if math.isfinite(limit):
        return np.float32(limit)
    return np.float32(max(CARMEN_MAX_RANGE, math.floor(greatest) + 1.0))


def _has_carmen_angles(first: Array, step: Array, beams: Indices) -> bool:
    """Whether all scans have the same number of beams, in the directions that CARMEN assumes for it."""
    if (beams != beams[0]).any():
        return False
    usual_first, usual_step = beam_angles(int(beams[0]))
    off = np.abs(first - usual_first) + beams * np.abs(step - usual_step)
    return bool((off < ANGLE_TOLERANCE).all())


def _param_lines(log: LaserLog, limit: np.float32, step: float) -> Iterator[str]:
    x, y, angle = log.mount.tolist()
    for name, value in (
        ("robot_frontlaser_offset", x + 0.0),
        ("robot_frontlaser_side_offset", y + 0.0),
        ("robot_frontlaser_angular_offset", angle + 0.0),
        ("robot_front_laser_max", limit),
        ("laser_front_laser_resolution", round(math.degrees(abs(step)), 6)),
    ):
        yield f"PARAM {name} {value!s} 0 {OWN_HOST.decode()} 0\n"


def _beam_texts(ranges: NDArray[np.float32], own: Indices, nothing: np.float32) -> Iterator[str]:
    """The number of beams and the ranges of each scan, in the fewest digits that give the same value."""
    values, places = np.unique(ranges, return_inverse=True, equal_nan=True)
    texts = np.array([_range_field(value, nothing) for value in values], dtype=object)
    for scan, beams in zip(places.reshape(ranges.shape), own.tolist(), strict=True):
        yield f"{beams} {' '.join(texts[scan[:beams]])}"


def _range_field(value: np.float32, nothing: np.float32) -> str:
    if np.isnan(value):
        return "0"
    return str(nothing if np.isinf(value) else value)


def _pose_fields(pose: Array) -> str:
    x, y, angle = (np.round([pose[0], pose[1], wrap(pose[2])], 9) + 0.0).tolist()
    return f"{x:.9f} {y:.9f} {angle:.9f}"
