"""The systematic error of odometry, by the map of a whole drive.

Wheels of another size than the file says make all ways too long or too short, and wheels of different sizes
bend them. Tracking learns this where scans tell their place (frontend/odometry_bias.py). Along bare corridors
they tell so little that the map lies between scans and odometry, all the way. Then each piece of the map is
off odometry by about the same, and a map without that is off by less.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nscan_cli.calibration.changed_odometry import with_changed_odometry
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, are_known, relative, wrap
from nscan_cli.slam.options import SystematicErrorOptions


class SystematicError(NamedTuple):
    """By how much odometry is off everywhere alike."""

    length: float
    """Length of a way by the map, as a multiple of that by odometry."""
    turn: float
    """Turn along a straight way by the map, less that by odometry, rad/m."""

    def and_then(self, more: SystematicError) -> SystematicError:
        """This one, and another one of the odometry without it."""
        return SystematicError(self.length * more.length, self.turn + more.turn * self.length)


def systematic_error(
    poses: Array,
    odometry: Array | None,
    breaks: Sequence[int],
    options: SystematicErrorOptions,
    min_length: float,
) -> SystematicError | None:
    """The systematic error of odometry (S, 3) by the poses (S, 3) of a map; None if it is not certain, or not
    there all the way, or if lengths are off by a smaller share than `min_length`, or a larger one than is
    likely.

    No piece of the path leads over the rows `breaks`, at which tracking broke.
    """
    if odometry is None or not are_known(odometry).any():
        return None
    pieces = _pieces(poses, odometry, breaks, options, options.window)
    if len(pieces) < options.min_pieces:
        return None
    means, sigmas = pieces.mean(axis=0), pieces.std(axis=0, ddof=1) / np.sqrt(len(pieces))
    certain = np.where(np.abs(means) > options.sigmas * sigmas, means, 0.0)
    parts = np.array([part[:, 0].mean() for part in np.array_split(pieces, options.parts)])
    if not min_length <= abs(certain[0]) <= options.max_length or (parts / means[0] < options.min_part).any():
        return None
    # Odometry that jumps now and then has longer ways, too, but most of it is right.
    short = _pieces(poses, odometry, breaks, options, options.short_window)
    if len(short) and float(np.median(short[:, 0])) / means[0] < options.min_part:
        return None
    return SystematicError(1.0 + float(certain[0]), float(certain[1]))


def without_systematic_error(log: LaserLog, error: SystematicError) -> LaserLog:
    """The log with its odometry corrected."""
    return with_changed_odometry(log, lambda poses, _times: _corrected(poses, error))


def _pieces(
    poses: Array, odometry: Array, breaks: Sequence[int], options: SystematicErrorOptions, window: float
) -> Array:
    """(n, 2) by how much each piece of the path, of a length `window` (m), is longer by the map, as a share,
    and by how much it turns more, rad/m.

    Pieces on which the robot turned around are left out: their ends tell no length.
    """
    known = np.flatnonzero(are_known(odometry))
    steps = relative(odometry[known[1:]], odometry[known[:-1]])
    along = np.append(0.0, np.cumsum(np.hypot(steps[:, 0], steps[:, 1])))
    segments = np.searchsorted(np.asarray(breaks), known, side="right")
    begins = np.flatnonzero(np.diff(segments, prepend=-1))
    ends = []
    for begin, end in zip(begins.tolist(), [*begins[1:].tolist(), len(known)], strict=True):
        # Each piece begins where the one before ends.
        at = begin
        while (then := int(np.searchsorted(along[:end], along[at] + window))) < end:
            ends.append((at, then))
            at = then
    first, last = known[np.array(ends, dtype=np.int64).reshape(-1, 2)].T
    by_map, by_odometry = relative(poses[last], poses[first]), relative(odometry[last], odometry[first])
    lengths, expected = (np.hypot(way[:, 0], way[:, 1]) for way in (by_map, by_odometry))
    used = expected > options.min_straightness * window
    turned = wrap(by_map[used, 2] - by_odometry[used, 2]) / window
    return np.stack([lengths[used] / expected[used] - 1.0, turned], axis=1)


def _corrected(poses: Array, error: SystematicError) -> Array:
    """Poses (S, 3) by odometry without its systematic error; nan where it is unknown."""
    known = np.flatnonzero(are_known(poses))
    steps = relative(poses[known[1:]], poses[known[:-1]])
    turned = error.turn * np.hypot(steps[:, 0], steps[:, 1])
    # Over an arc, the chord turns by half as much.
    headings = poses[known[0], 2] + np.append(0.0, np.cumsum(steps[:, 2] + turned))
    directions = headings[:-1] + np.arctan2(steps[:, 1], steps[:, 0]) + 0.5 * turned
    lengths = error.length * np.hypot(steps[:, 0], steps[:, 1])
    corrected = poses.copy()
    corrected[known[1:], 0] = poses[known[0], 0] + np.cumsum(lengths * np.cos(directions))
    corrected[known[1:], 1] = poses[known[0], 1] + np.cumsum(lengths * np.sin(directions))
    corrected[known, 2] = wrap(headings)
    return corrected


def systematic_error_said(error: SystematicError, reading: ReadingOptions) -> str:
    """What is said of odometry that is used without its error."""
    longer, veer = 1.0 / error.length - 1.0, np.degrees(error.turn)
    turns = f" and turns {abs(veer):.1f}° a metre too far {'right' if veer > 0 else 'left'}"
    return (
        f"odometry is {abs(longer):.1%} too {'long' if longer > 0 else 'short'}{turns if error.turn else ''} "
        "everywhere, by the map: it is used without that; --as-recorded uses it as it is; if the ranges are "
        f"wrong instead, --range-scale {(reading.range_scale or 1.0) / error.length:.3g} corrects them"
    )
