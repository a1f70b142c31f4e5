"""Step 1 without odometry: scans that fit badly or tell little are tracked from behind, too.

Few beams hit a wall far ahead, too few for a Gaussian. So a robot that drives off, or drives as its log
begins, seems to stand until the wall is near. From behind, the wall is near first, and its Gaussians hold the
scans before.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.logs.mask_runs import mask_runs
from nscan_cli.poses import Array, Mask, compose, inverse, relative, wrap
from nscan_cli.slam.frontend.options import TrackingOptions
from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from nscan_cli.slam.frontend.tracker import Tracker


class MotionFromBehind(NamedTuple):
    """How the robot moved where the track from behind fits better, or as well."""

    poses: Array
    """(n, 3); nan elsewhere."""
    weakest_sigmas: Array
    """(n,) standard deviation of the positions that the scans measure, m; 0 elsewhere."""
    unproven: list[tuple[int, int]]
    """Stretches (first, end) where it fits only as well: whether it is better is yet to be seen."""

    def where_proven(self, front: Array, along: Array, least: float) -> MotionFromBehind | None:
        """It without unproven stretches that lower the objective by less than `least`; None if none stays.

        `front` (n,) are the values of the objective as scans were tracked from the front, `along` (n,) those
        along this motion. They are compared in the stretch and in as many scans after it, which do not fit
        the map of a wrong one.
        """
        motion = MotionFromBehind(self.poses.copy(), self.weakest_sigmas.copy(), [])
        for first, end in self.unproven:
            compared = slice(first, end + (end - first))
            if float((front[compared] - along[compared]).sum()) < least:
                motion.poses[_with_ends(first, end)] = np.nan
                motion.weakest_sigmas[_with_ends(first, end)] = 0.0
        return motion if np.isfinite(motion.poses).any() else None


def motion_from_behind(
    scans: ScanBatch, found: TrackedScans, tracker: Tracker, options: TrackingOptions
) -> MotionFromBehind | None:
    """The motion of scans (n) as `tracker`, a new one, finds it from the last to the first.

    It is known in stretches where the robot, as it was `found`, seems to stand or to slow down, and where its
    way from behind is longer, and scans fit clearly better, or at least as well. None without such
    stretches. The scans stay as they are.
    """
    doubtful, count = _doubtful_stretches(found, options), len(found.values)
    parts = [_standing_part(found.poses, each, range(each[1] + 1, count), options) for each in doubtful]
    stretches = [part for part in parts if part is not None and _may_fit(found, part, options)]
    if not stretches:
        return None
    # Where scans tell the motion, it leads from behind, too.
    known = found.poses.copy()
    for first, end in doubtful:
        known[first:end] = np.nan
    # No scan before the step to the first of them matters.
    since = max(stretches[0][0] - 1, 0)
    behind = tracker.track(scans.part(since, count).backwards(known[since:]))
    inliers, poses, sigmas = behind.inliers[::-1], behind.poses[::-1], behind.weakest_sigmas[::-1]
    from_front = found.part(since, count)
    is_turn = _turns_from_front(from_front, inliers, sigmas, options)
    poses = _with_steps(poses, from_front.poses, is_turn)
    # What scans tell from one side alone may be the ripple of their walls.
    tells = sigmas <= options.scan.degeneracy.trusted_sigma
    sigmas = np.where(tells, sigmas, np.maximum(sigmas, from_front.weakest_sigmas))
    sigmas = np.where(is_turn, from_front.weakest_sigmas, sigmas)
    motion = MotionFromBehind(np.full((count, 3), np.nan), np.zeros(count), [])
    fastest = _fastest(found.poses, range(1, count), options)
    for first, end in stretches:
        way = _way(poses, first - since, end - since)
        share = float(inliers[first - since : end - since].mean())
        gain = share - float(found.inliers[first:end].mean())
        is_clear = gain >= options.standstill_gain
        fits = share >= options.scan.restart_inliers and gain >= -options.standstill_gain
        if not fits or way - _way(found.poses, first, end) <= options.standstill_lag:
            continue
        whole, ends = _with_ends(first, end), _with_ends(first - since, end - since)
        turns = [np.abs(wrap(np.diff(each[:, 2]))).max() for each in (found.poses[whole], poses[ends])]
        tells = found.weakest_sigmas[first:end] <= options.scan.degeneracy.trusted_sigma
        # Ripples lead on as well as they hold: what fits as well is no faster than the robot ever goes.
        is_fast = way > fastest * (end - first)
        # What a robot sees that turns far is new, so that its turn, too, may be wrong from both sides. Where
        # most scans tell their place, they fit badly, and what fits better may be at a wrong place.
        if is_clear or (max(turns) <= options.standstill_turn and tells.mean() < 0.5 and not is_fast):
            motion.poses[whole], motion.weakest_sigmas[whole] = poses[ends], sigmas[ends]
            motion.unproven.extend([] if is_clear else [(first, end)])
    return motion if np.isfinite(motion.poses).any() else None


def _with_ends(first: int, end: int) -> slice:
    """The scans of a stretch, the step to the first of them, and the one from the last."""
    return slice(max(first - 1, 0), end + 1)


def _turns_from_front(found: TrackedScans, inliers: Array, sigmas: Array, options: TrackingOptions) -> Mask:
    """(n,) to which scans the robot turned far, as they were `found` from the front.

    A robot that turns round has hardly anything in view there that it sees before, or after. From behind
    little was seen but walls ahead of it: a scan that fits no better, or does not tell its place, is wrong.
    Then shares of inliers are `inliers` (n,), and standard deviations of places `sigmas` (n,), m.
    """
    trusted = options.scan.degeneracy.trusted_sigma
    turns = np.append(False, np.abs(wrap(np.diff(found.poses[:, 2]))) > options.standstill_turn)
    fits_as_well = found.inliers >= inliers - options.standstill_gain
    believed: Mask = turns & (found.weakest_sigmas <= trusted) & (fits_as_well | (sigmas > trusted))
    return believed


def _with_steps(poses: Array, others: Array, chosen: Mask) -> Array:
    """Poses (n, 3) to the `chosen` (n,) of which the robot came as it came to `others` (n, 3)."""
    found = poses.copy()
    for k in np.flatnonzero(chosen).tolist():
        came = compose(found[k - 1], relative(others[k], others[k - 1]))
        found[k:] = compose(compose(came, inverse(found[k])), found[k:])
    return found


def _may_fit(found: TrackedScans, stretch: tuple[int, int], options: TrackingOptions) -> bool:
    """Whether scans of a stretch may fit from behind: there are later ones to begin with.

    A stretch of fewer scans than tell a velocity does not tell that the robot stands.
    """
    first, end = stretch
    return end - first >= options.velocity_scans and end < len(found.values)


def count_before_doubt(found: TrackedScans, options: TrackingOptions, is_start: bool) -> int:
    """The number of scans before a stretch at the end that later scans may tell more of; else that of all.

    Too few scans after it tell how fast the robot goes. It does not tell its place, and the robot seems to
    stand, or it is the start of a track.
    """
    *_, (first, end) = _doubtful_stretches(found, options) or [(0, 0)]
    count = len(found.values)
    if first == end or count - end > options.velocity_scans:
        return count
    stands = _standing_part(found.poses, (first, end), range(1, first), options) is not None
    return first if stands or (is_start and first == 0) else count


def _doubtful_stretches(found: TrackedScans, options: TrackingOptions) -> list[tuple[int, int]]:
    """The stretches (first, end) without `velocity_scans` in a row that fit and tell their place.

    Two are one if the robot seems to stand between them: a ripple may hold it there, too.
    """
    tells = found.inliers >= options.scan.restart_inliers
    tells &= found.weakest_sigmas <= options.scan.degeneracy.trusted_sigma
    for first, end in mask_runs(tells):
        stands = first > 0 and end < len(tells) and _way(found.poses, first, end) <= options.standstill_lag
        if stands or end - first < options.velocity_scans:
            tells[first:end] = False
    return mask_runs(~tells)


def _standing_part(
    poses: Array, stretch: tuple[int, int], others: range, options: TrackingOptions
) -> tuple[int, int] | None:
    """The part (first, end) of a stretch in which the robot falls far behind its highest speed in `others`.

    A stretch of all scans may be one of a short log, with the highest speed in it.
    """
    first, end = stretch
    fastest = _fastest(poses, range(1, len(poses)) if end - first == len(poses) else others, options)
    begins, lag, most, part = first, 0.0, 0.0, None
    for k in range(first, end):
        if lag <= 0.0:
            begins, lag = k, 0.0
        lag += options.standstill_share * fastest - _way(poses, k, k + 1)
        if lag > most:
            most, part = lag, (begins, k + 1)
    if part is None or fastest * (part[1] - part[0]) - _way(poses, *part) <= options.standstill_lag:
        return None
    return part


def _fastest(poses: Array, scans: range, options: TrackingOptions) -> float:
    """The largest way of a scan, m, in the mean of `velocity_scans` among these scans."""
    run = options.velocity_scans
    starts = range(scans.start, scans.stop - run + 1)
    return max((_way(poses, at, at + run) / run for at in starts), default=0.0)


def _way(poses: Array, first: int, end: int) -> float:
    """Distance (m) from the scan before a stretch to its last."""
    return float(np.hypot(*(poses[end - 1] - poses[max(first - 1, 0)])[:2]))
