"""What goes along with the robot without being a part of it: a cart on a hinge, someone who follows or leads.

Its ranges vary, so it is no part of the robot. It is no part of the map either, which it seems to hold still.
But it is where the robot itself was a moment ago or will be in a moment, and no wall is there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.calibration.companion_options import CompanionOptions
from nscan_cli.calibration.companion_region import where_it_is
from nscan_cli.logs.beam_mask import Bearings, mask_beams, mask_text
from nscan_cli.logs.field_of_view import field_of_view
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.robot_parts import evenly
from nscan_cli.poses import Array, Mask, are_known, compose, transform


@dataclass(frozen=True)
class Companion:
    """Something that goes along."""

    share: float
    """Share of the checked scans in which it is on the robot's path."""
    sectors: list[Bearings]
    """Sectors in which it is seen, and the range up to which it is, in the laser's frame, rad and m."""

    @property
    def seen(self) -> str:
        """What was found, for a message."""
        return (
            f"something goes along with the robot: in {self.share:.0%} of the scans it is where the robot "
            "itself has just been or is about to be, as a cart or someone who follows"
        )

    def mask(self, others: tuple[Bearings, ...]) -> tuple[Bearings, ...]:
        """The sectors to leave out: `others`, which are already, and its own."""
        return (*others, *self.sectors)


def checked_companion(
    log: LaserLog, reading: ReadingOptions, options: CompanionOptions
) -> tuple[LaserLog, ReadingOptions, list[str]]:
    """The log without the readings of what goes along by its odometry, how it is read, messages."""
    found = None if log.odometry is None else find_companion(log, log.odometry, options)
    if found is None:
        return log, reading, []
    ranges = log.ranges.copy()
    mask_beams(ranges, log.angle_min, log.angle_increment, found.sectors)
    mask = found.mask(log.report.masked)
    said = (
        f"{found.seen}; readings of it are left out, as by --mask {mask_text(mask)}; --as-recorded uses them"
    )
    return replace(log, ranges=ranges), replace(reading, mask=mask), [said]


def find_companion(log: LaserLog, poses: Array, options: CompanionOptions) -> Companion | None:
    """What goes along in a log whose robot moves through poses (S, 3), nan where unknown; None if nothing."""
    rows = np.flatnonzero(are_known(poses))

    def seen(k: int) -> Array | None:
        begin, end = np.searchsorted(at, along[k] + options.farthest * np.array([-1.0, 1.0]))
        about = path[begin:end][np.abs(at[begin:end] - along[k]) > options.nearest]
        return _seen(log, int(rows[k]), poses[rows[k]], about, options)

    steps = np.hypot(*np.diff(poses[rows, :2], axis=0).T)
    # Who jumps is not followed over the jump.
    along = np.append(0.0, np.cumsum(np.where(steps > options.longest_step, options.farthest, steps)))
    if along[-1] < options.min_way:
        return None
    at = np.arange(0.0, along[-1], options.path_step)
    path = np.stack([np.interp(at, along, column) for column in poses[rows, :2].T], axis=1)
    # Evenly by the way: a robot that stands tells nothing.
    some = np.unique(np.searchsorted(along, np.linspace(0.0, along[-1], options.scans)))
    found, looked_at = list[Array](), 0
    for part in range(options.first_of):
        for k in some[part :: options.first_of].tolist():
            reach = seen(k)
            looked_at += reach is not None
            if reach is not None and reach.any():
                found.append(reach)
        # Mostly nothing goes along, and a few scans show it.
        if len(found) < options.clear_share * looked_at:
            return None
    share, reaches = len(found) / max(looked_at, 1), np.array(found)
    if share < options.min_share or not _is_somewhere(reaches, log, options):
        return None
    # A cart swings aside where the robot turns on the spot, which is no way.
    often = evenly(len(rows), options.region_scans)
    found = [reach for k in often.tolist() if (reach := seen(k)) is not None and reach.any()]
    return Companion(share, where_it_is(log, np.array(found), options))


def _seen(log: LaserLog, row: int, pose: Array, path: Array, options: CompanionOptions) -> Array | None:
    """How far (m) a scan at a pose (3,) sees something on the path (n, 2) around it, by bins of bearings.

    (b,), 0 where it does not; None if no point of the path is far enough from the robot.
    """
    reach = np.zeros(round(2 * np.pi / options.bin_width))
    away = np.hypot(*(path - pose[:2]).T)
    if not (away > options.clearance).any():
        return None
    # No reading that is looked at ends near the rest of it.
    farthest = options.max_range + float(np.hypot(*log.mount[:2])) + options.radius
    path = path[(away > options.clearance) & (away < farthest)]
    every = max(log.ranges.shape[1] // options.max_beams, 1)
    ranges = log.readings(row)[::every]
    bearings = log.angle_min[row] + every * log.angle_increment[row] * np.arange(len(ranges))
    is_near = np.isfinite(ranges) & (ranges < options.max_range)
    ranges, bearings = ranges[is_near].astype(np.float64), bearings[is_near]
    ends = np.stack([ranges * np.cos(bearings), ranges * np.sin(bearings)], axis=1)
    places = transform(compose(pose, log.mount), ends)
    is_on_path = _is_on_path(places, path, options.radius)
    if np.count_nonzero(is_on_path) < options.min_beams:
        return reach
    # The rest of it is joined to that and not far away.
    middle = places[is_on_path].mean(axis=0)
    is_joined = np.hypot(*np.diff(places, axis=0).T) < options.max_gap
    groups = np.append(0, np.cumsum(~is_joined))
    is_of_it = np.isin(groups, groups[is_on_path]) & (np.hypot(*(places - middle).T) < options.max_size)
    bins = np.floor(np.mod(bearings[is_of_it], 2 * np.pi) / options.bin_width).astype(np.int64)
    np.maximum.at(reach, bins % len(reach), ranges[is_of_it])
    return reach


def _is_on_path(places: Array, path: Array, radius: float) -> Mask:
    """(m,) which of the places (m, 2) are within a radius (m) of the path (n, 2)."""
    squares = (places[:, :1] - path[:, 0]) ** 2 + (places[:, 1:] - path[:, 1]) ** 2
    near: Mask = np.any(squares < radius**2, axis=1)
    return near


def _is_somewhere(reaches: Array, log: LaserLog, options: CompanionOptions) -> bool:
    """Whether scans mostly see it in the same quarter of all bearings: dust and noise are everywhere.

    `reaches` (n, b) are those of `_seen`. For a laser that sees less than three quarters of a turn, the
    quarter is a third of what it sees. A scan counts once, also if a cart that swings round fills it.
    """
    first, last, _ = field_of_view(log)
    view = round(abs(last - first) / options.bin_width / 3)
    is_seen = reaches > 0.0
    shares = np.sort((is_seen / is_seen.sum(axis=1, keepdims=True)).mean(axis=0))[::-1]
    most = min(len(shares) // 4, view)
    return bool(shares[:most].sum() >= options.min_quarter_share)
