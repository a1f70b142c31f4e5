"""Step 1 in compiled code: scan after scan is predicted, matched and added to the map of the last metres.

It stops at a scan that the match with the map does not explain; see tracking.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nscan_cli.kernels.assign import assign, assign_rows
from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.pose_kernels import composed_pose, relative_pose, wrapped
from nscan_cli.matching.priors import Prior, motion_sigmas
from nscan_cli.ndt.grid_growth import CELLS_PER_POINT, change_points
from nscan_cli.ndt.hash_grid import Grid
from nscan_cli.poses import Array, transform
from nscan_cli.slam.frontend.constant_velocity import UNSTEADY, constant_velocity
from nscan_cli.slam.frontend.scan_to_map import match_and_count
from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from nscan_cli.slam.frontend.tracking_parameters import TrackingParameters
from nscan_cli.slam.frontend.visible_points import visible_points

SCANS, OLDEST, KNOWN, ROWS, RESTARTS = 0, 1, 2, 3, 4
"""What is counted: scans that have joined the map, the oldest of them that it still holds, the last poses
that are known, the rows of the grid, and how often scans were matched from more angles."""
CLEARLY = 0.05
"""By so many inliers more the match from another start must be better."""
LEAST_SCORE = 0.3
"""What a search must find at least; with fewer inliers a scan is lost, whatever the odometry says."""
STEADY = 3
"""From so many poses on there is a motion to go on with."""


class Track(NamedTuple):
    """Where the robot came along, and the scans of the map."""

    poses: Array
    """(h, 3) the last ones, the newest last."""
    odometry: Array
    """(3,) of the last scan; nan where there is none."""
    joined: Array
    """(3,) pose of the last scan that joined the map."""
    points: Array
    """(P, 2) of the scans of the map, one after another, each in its robot's frame."""
    ends: NDArray[np.int64]
    """(W + 1,) scan s of the map has points[ends[s] : ends[s + 1]]."""
    placed: Array
    """(W, 4) its pose, and the path (m) up to there."""
    counts: NDArray[np.int64]
    """(5,) SCANS, OLDEST, KNOWN, ROWS and RESTARTS"""
    path: Array
    """(1,) length of the path, m."""
    inliers: Array
    """(1,) share of inliers of the last scan."""
    unsteady: Array
    """(1,) mean square (m²) of how far scans are found off steady motion."""

    @classmethod
    def begin(cls, last: int) -> Track:
        """A track that has not begun, of which so many last poses will be known."""
        scans = np.zeros((0, 2)), np.zeros(1, dtype=np.int64), np.zeros((0, 4))
        counts, (path, inliers) = np.zeros(5, dtype=np.int64), np.zeros((2, 1))
        robot = np.zeros((last, 3)), np.full(3, np.nan), np.zeros(3)
        return cls(*robot, *scans, counts, path, inliers, np.array([UNSTEADY**2]))

    def with_room(self, scans: int, points: int) -> Track:
        """The track with room for so many more scans, and points of them, in its map."""
        oldest, newest = self.counts[[OLDEST, SCANS]].tolist()
        first, last = self.ends[[oldest, newest]].tolist()
        if newest + scans <= len(self.placed) and last + points <= len(self.points):
            return self
        held, held_points = newest - oldest, last - first
        roomy_points, placed = np.empty((2 * (held_points + points), 2)), np.empty((2 * (held + scans), 4))
        ends = np.empty(len(placed) + 1, dtype=np.int64)
        roomy_points[:held_points], placed[:held] = self.points[first:last], self.placed[oldest:newest]
        ends[: held + 1] = self.ends[oldest : newest + 1] - first
        self.counts[[OLDEST, SCANS]] = 0, held
        return self._replace(points=roomy_points, ends=ends, placed=placed)

    def recent(self, path: float) -> Array:
        """The points (m, 2) of the map's scans over the last `path` (m), in the tracker's frame."""
        oldest, newest = self.counts[[OLDEST, SCANS]].tolist()
        return np.concatenate(
            [
                transform(self.placed[scan, :3], self.points[self.ends[scan] : self.ends[scan + 1]])
                for scan in range(oldest, newest)
                if self.placed[scan, 3] > self.path[0] - path
            ]
        )


@kernel
def match_turned(
    grid: Grid,
    settings: TrackingParameters,
    points: Array,
    prior: Prior,
    enough: float,
    counts: NDArray[np.int64],
    found: TrackedScans,
    k: int,
) -> None:
    """Match scan k, which has fewer inliers than are `enough` where it was found, from other angles too.

    What clearly more points fit takes its place if its objective is lower as well.
    """
    pose, hessian = np.empty(3), np.empty((3, 3))
    for ring in range(settings.turns.shape[0]):
        if found.inliers[k] >= (settings.far_share if ring > 0 else enough):
            break
        counts[RESTARTS] += 1
        for turn in settings.turns[ring]:
            for sign in (1.0, -1.0):
                if np.isnan(turn):
                    continue
                assign(pose, prior.mean)
                pose[2] += sign * turn
                value, inliers = match_and_count(grid, settings, points, prior, pose, hessian)
                # From elsewhere it may slide along a corridor; a wrong turn shows in what then fits.
                if inliers > found.inliers[k] + CLEARLY and value < found.values[k]:
                    found.values[k], found.inliers[k] = value, inliers
                    assign(found.poses[k], pose)
                    assign_rows(found.hessians[k], hessian)


@kernel
def told_points(track: Track, settings: TrackingParameters, points: Array, pose: Array) -> Array:
    """The points of a scan expected at `pose` (3,) of which the map can tell; see in_view."""
    placed = track.placed[track.counts[OLDEST] : track.counts[SCANS]]
    return visible_points(points, pose, placed, settings.in_view)


@kernel
def predict(track: Track, settings: TrackingParameters, odometry: Array, prior: Prior) -> None:
    """Write where the next scan is expected, in the tracker's frame, and how surely.

    By its odometry (3,), or without, as by steady motion.
    """
    known, last = track.counts[KNOWN], track.poses[-1]
    step = np.empty(3)
    if np.isfinite(odometry[0]) and np.isfinite(track.odometry[0]):
        relative_pose(odometry, track.odometry, step)
        step[2] = wrapped(step[2])
        along, about = motion_sigmas(step, settings.odometry)
    else:
        relative_pose(last, track.poses[-known], step)
        step[2] = wrapped(step[2])
        step /= max(known - 1, 1)
        along, about = motion_sigmas(step, settings.steady_motion)
    composed_pose(last, step, prior.mean)
    prior.mean[2] = wrapped(prior.mean[2])
    # As sure along the path as across it: no need to turn the information.
    prior.information[:, :] = 0.0
    prior.information[0, 0] = prior.information[1, 1] = along**-2
    prior.information[2, 2] = about**-2


@kernel
def least_share(track: Track, settings: TrackingParameters) -> float:
    """With fewer inliers the next scan is matched from other angles too.

    One that is off sideways can have four fifths of them: what tells is that the scan before had more.
    Without odometry more than the angle is a guess.
    """
    before = track.inliers[0] if np.isfinite(track.odometry[0]) else 0.0
    return max(settings.inlier_share, float(before) - CLEARLY)


@kernel
def take(
    track: Track,
    grid: Grid,
    settings: TrackingParameters,
    points: Array,
    odometry: Array,
    prior: Prior,
    found: TrackedScans,
    k: int,
) -> None:
    """Settle scan k where it was found; it joins the map when the robot has moved, and old ones leave it.

    Its pose, inliers and Hessian of the objective were written to `found`; the rest is written here.
    """
    counts, pose, step = track.counts, found.poses[k], np.empty(3)
    pose[2] = wrapped(pose[2])
    relative_pose(pose, track.joined, step)
    distance = np.hypot(step[0], step[1])
    # Before anything was seen there is nothing to move against.
    nothing_seen = counts[ROWS] == 0
    joins = nothing_seen or distance > settings.step or abs(wrapped(step[2])) > settings.step
    if joins:
        track.path[0] += distance
        assign(track.joined, pose)
        _join(track, grid, settings, points, pose)
    for row in range(track.poses.shape[0] - 1):
        assign(track.poses[row], track.poses[row + 1])
    assign(track.poses[-1], pose)
    found.off[k] = 0.0
    if np.isfinite(odometry[0]) and np.isfinite(track.odometry[0]):
        off = np.hypot(pose[0] - prior.mean[0], pose[1] - prior.mean[1])
        found.off[k] = off * np.sqrt(prior.information[0, 0])
    assign(track.odometry, odometry)
    counts[KNOWN] = min(counts[KNOWN] + 1, track.poses.shape[0])
    track.inliers[0] = found.inliers[k]
    found.paths[k], found.joined[k] = track.path[0], joins
    found.expected[k] = 0.0
    for a in range(3):
        for b in range(3):
            found.hessians[k, a, b] -= prior.information[a, b]
        if prior.information[a, a] > 0.0:
            found.expected[k, a, a] = 1.0 / prior.information[a, a]


@kernel
def _join(track: Track, grid: Grid, settings: TrackingParameters, points: Array, pose: Array) -> None:
    counts, newest = track.counts, track.counts[SCANS]
    first = track.ends[newest]
    assign_rows(track.points[first : first + points.shape[0]], points)
    track.ends[newest + 1] = first + points.shape[0]
    assign(track.placed[newest, :3], pose)
    track.placed[newest, 3] = track.path[0]
    counts[SCANS] += 1
    _change(track, grid, settings, newest, 1.0)
    while track.placed[counts[OLDEST], 3] < track.path[0] - settings.window:
        _change(track, grid, settings, counts[OLDEST], -1.0)
        counts[OLDEST] += 1


@kernel
def _change(track: Track, grid: Grid, settings: TrackingParameters, scan: int, sign: float) -> None:
    points, pose = track.points[track.ends[scan] : track.ends[scan + 1]], track.placed[scan, :3]
    # Half of the Gaussians change again before any point meets them.
    track.counts[ROWS] = change_points(grid, track.counts[ROWS], settings.half, points, pose, sign, False)


@kernel
def follow(
    track: Track,
    grid: Grid,
    settings: TrackingParameters,
    points: Array,
    ends: NDArray[np.int64],
    odometry: Array,
    first: int,
    prior: Prior,
    found: TrackedScans,
) -> int:
    """Track scans from the `first` on, and return the next one, which is not settled.

    Scan k has points[ends[k] : ends[k + 1]] and odometry[k], nan where there is none. The one that is not
    settled has so few inliers where it was `found` that it is to be searched; or they are nan: there is no
    room for it in the grid.
    """
    for k in range(first, ends.shape[0] - 1):
        scan = points[ends[k] : ends[k + 1]]
        if track.counts[ROWS] + CELLS_PER_POINT * scan.shape[0] > grid.keys.shape[0]:
            found.inliers[k] = np.nan
            return k
        if track.counts[KNOWN] == 0:
            prior.mean[:], prior.information[:, :] = 0.0, 0.0
            found.values[k], found.poses[k], found.hessians[k], found.inliers[k] = 0.0, 0.0, 0.0, 1.0
        else:
            predict(track, settings, odometry[k], prior)
            told = told_points(track, settings, scan, prior.mean)
            assign(found.poses[k], prior.mean)
            found.values[k], found.inliers[k] = match_and_count(
                grid, settings, told, prior, found.poses[k], found.hessians[k]
            )
            enough = least_share(track, settings)
            if found.inliers[k] < enough:
                match_turned(grid, settings, told, prior, enough, track.counts, found, k)
                if found.inliers[k] < (LEAST_SCORE if np.isfinite(odometry[k, 0]) else settings.inlier_share):
                    return k
            if track.counts[KNOWN] >= STEADY and not np.isfinite(odometry[k, 0]):
                constant_velocity(grid, settings, told, prior, track.unsteady, found, k)
        take(track, grid, settings, scan, odometry[k], prior, found, k)
    return len(ends) - 1
