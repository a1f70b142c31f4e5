"""What goes along with the robot without being a part of it: a cart on a hinge, someone who follows or leads.

Its ranges vary, so it is no part of the robot. It is no part of the map either, which it seems to hold still.
But it is where the robot itself was a moment ago or will be in a moment, and no wall is there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nscan_cli.calibration.companion_options import CompanionOptions
from nscan_cli.logs.beam_mask import Bearings, mask_beams, mask_text
from nscan_cli.logs.field_of_view import field_of_view
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, Indices, Mask, are_known, compose, transform


@dataclass(frozen=True)
class Companion:
    """Something that goes along."""

    share: float
    """Share of the checked scans in which it is on the robot's path."""
    sectors: list[Bearings]
    """Sectors in which it is seen, in the laser's frame, rad."""

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
    """The log without the beams that see what goes along by its odometry, how it is read, messages."""
    found = None if log.odometry is None else find_companion(log, log.odometry, options)
    if found is None:
        return log, reading, []
    ranges = log.ranges.copy()
    mask_beams(ranges, log.angle_min, log.angle_increment, found.sectors)
    mask = found.mask(log.report.masked)
    said = f"{found.seen}; its beams are left out, as by --mask {mask_text(mask)}; --as-recorded uses them"
    return replace(log, ranges=ranges), replace(reading, mask=mask), [said]


def find_companion(log: LaserLog, poses: Array, options: CompanionOptions) -> Companion | None:
    """What goes along in a log whose robot moves through poses (S, 3), nan where unknown; None if nothing."""
    rows = np.flatnonzero(are_known(poses))
    steps = np.hypot(*np.diff(poses[rows, :2], axis=0).T)
    # Who jumps is not followed over the jump.
    along = np.append(0.0, np.cumsum(np.where(steps > options.longest_step, options.farthest, steps)))
    if along[-1] < options.min_way:
        return None
    at = np.arange(0.0, along[-1], options.path_step)
    path = np.stack([np.interp(at, along, column) for column in poses[rows, :2].T], axis=1)
    # Evenly by the way: a robot that stands tells nothing.
    some = np.unique(np.searchsorted(along, np.linspace(0.0, along[-1], options.scans)))
    found, looked_at = list[Indices](), 0
    for part in range(options.first_of):
        for k in some[part :: options.first_of].tolist():
            begin, end = np.searchsorted(at, along[k] + options.farthest * np.array([-1.0, 1.0]))
            about = path[begin:end][np.abs(at[begin:end] - along[k]) > options.nearest]
            seen = _seen(log, int(rows[k]), poses[rows[k]], about, options)
            looked_at += seen is not None
            if seen is not None and len(seen):
                found.append(seen)
        # Mostly nothing goes along, and a few scans show it.
        if len(found) < options.clear_share * looked_at:
            return None
    share = len(found) / max(looked_at, 1)
    if share < options.min_share or not _is_somewhere(found, log, options):
        return None
    return Companion(share, _sectors(found, options))


def _seen(log: LaserLog, row: int, pose: Array, path: Array, options: CompanionOptions) -> Indices | None:
    """The bins of bearings in which a scan at a pose (3,) sees something on the path (n, 2) around it.

    None if no point of the path is far enough from the robot.
    """
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
        return np.zeros(0, dtype=np.int64)
    # The rest of it is joined to that and not far away.
    middle = places[is_on_path].mean(axis=0)
    is_joined = np.hypot(*np.diff(places, axis=0).T) < options.max_gap
    groups = np.append(0, np.cumsum(~is_joined))
    is_of_it = np.isin(groups, groups[is_on_path]) & (np.hypot(*(places - middle).T) < options.max_size)
    return np.unique(np.floor(np.mod(bearings[is_of_it], 2 * np.pi) / options.bin_width).astype(np.int64))


def _is_on_path(places: Array, path: Array, radius: float) -> Mask:
    """(m,) which of the places (m, 2) are within a radius (m) of the path (n, 2)."""
    squares = (places[:, :1] - path[:, 0]) ** 2 + (places[:, 1:] - path[:, 1]) ** 2
    near: Mask = np.any(squares < radius**2, axis=1)
    return near


def _is_somewhere(seen: list[Indices], log: LaserLog, options: CompanionOptions) -> bool:
    """Whether bins of bearings are mostly seen in the same quarter of them: dust and noise are everywhere.

    For a laser that sees less than three quarters of a turn, the quarter is a third of what it sees.
    """
    first, last, _ = field_of_view(log)
    size, view = round(2 * np.pi / options.bin_width), abs(last - first) / options.bin_width
    counts = np.sort(np.bincount(np.concatenate(seen), minlength=size))[::-1]
    most = min(size // 4, round(view / 3))
    return bool(counts[:most].sum() >= options.min_quarter_share * counts.sum())


def _sectors(seen: list[Indices], options: CompanionOptions) -> list[Bearings]:
    """The sectors of bins that are seen in more than a few of the scans, and a bin to each side."""
    size = round(2 * np.pi / options.bin_width)
    counts = np.bincount(np.concatenate(seen), minlength=size)[:size]
    # No more than half of all: the rest is what the map is made from.
    often = counts > max(options.min_sector_share * len(seen), int(np.sort(counts)[size // 2]))
    chosen = often | np.roll(often, 1) | np.roll(often, -1)
    begins = np.flatnonzero(chosen & ~np.roll(chosen, 1))
    ends = np.flatnonzero(chosen & ~np.roll(chosen, -1)) + 1
    # The last sector may go on beyond 0.
    if len(ends) and ends[0] <= begins[0]:
        ends = np.roll(ends, -1)
    return [
        (_bearing(begin * options.bin_width), _bearing(end * options.bin_width))
        for begin, end in zip(begins.tolist(), ends.tolist(), strict=True)
    ]


def _bearing(angle: float) -> float:
    """An angle (rad) as a bearing from −π to π."""
    return float(np.mod(angle + np.pi, 2 * np.pi) - np.pi)
