"""Step 1 of the loop (paper, V): the pose of every scan by matching it with the map of the last metres.

The map is one NDT that grows by the scans ahead and loses those behind, in a frame of its own: what
loops later correct in the graph never tears it.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from nscan_cli.compiled import kernel
from nscan_cli.matching.newton import PairProblem, minimise
from nscan_cli.matching.priors import Prior, odometry_prior
from nscan_cli.matching.search import likelihood_field, search
from nscan_cli.ndt.energy import inlier_share
from nscan_cli.ndt.grid import Ndt
from nscan_cli.poses import Array, compose, relative, transform, wrap
from nscan_cli.slam.options import TrackingOptions

RECENT = 5.0
"""A lost scan is searched among those of the last stretch of path, m."""
CLEARLY = 0.05
"""By so many inliers more the match from another start must be better."""
LEAST_SCORE = 0.3
"""What a search must find at least; with fewer inliers a scan is lost, whatever the odometry says."""


@dataclass(frozen=True)
class Tracked:
    """Where a scan was found."""

    pose: Array
    """(3,) of the robot in the tracker's frame."""
    hessian: Array
    """(3, 3) of scale · E there, without the prior."""
    expected: Array
    """(3, 3) covariance of the step to here before the match: the odometry's, or of steady motion."""
    inliers: float
    """Share of the points that lie on a Gaussian of the map."""
    path: float
    """Length of the path up to here, m."""
    joined: bool
    """Whether the scan's points joined the map."""


class Match(NamedTuple):
    """An optimum for a scan."""

    value: float
    """Of the objective."""
    pose: Array
    """(3,)"""
    hessian: Array
    """(3, 3) of the objective."""
    inliers: float
    """Share of the points."""


@kernel
def match_and_count(
    problem: PairProblem,
    pose: Array,
    widenings: Array,
    max_iterations: int,
    tolerance: float,
    hessian: Array,
    bound: float,
) -> tuple[float, float]:
    """Minimise from `pose` (3,), in place; the objective's value, and the share of inliers there."""
    value, _, _, _, _ = minimise(problem, pose, widenings, max_iterations, tolerance, hessian)
    return value, inlier_share(problem.grid, problem.half, problem.points, pose, bound)


class Tracker:
    """Follows the robot from scan to scan."""

    def __init__(self, options: TrackingOptions) -> None:
        self.options = options
        gaussians = options.gaussians
        self.map = Ndt(gaussians.cell, gaussians.minimum, gaussians.floor, capacity=1 << 14)
        self.restarts = self.searches = 0
        self._window: deque[tuple[Array, Array, float]] = deque()
        self._poses: deque[Array] = deque(maxlen=options.steady_scans + 1)
        self._joined = np.zeros(3)
        self._path = 0.0
        self._odometry: Array | None = None
        self._widenings = np.array(options.widenings)

    def track(self, points: Array, odometry: Array | None) -> Tracked:
        """The pose of the next scan: points (m, 2) in the robot's frame, odometry pose (3,) or None."""
        if not self._poses:
            self._odometry = odometry
            return self._settle(np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3)), 1.0, points)
        prior = self._predict(odometry)
        self._odometry = odometry
        match = self._match(points, prior, prior.mean)
        for ring in self.options.turns:
            if match.inliers >= self.options.inlier_share:
                break
            self.restarts += 1
            for turn in (sign * angle for angle in ring for sign in (1, -1)):
                candidate = self._match(points, prior, prior.mean + np.array([0.0, 0.0, turn]))
                # From elsewhere it may slide along a corridor; a wrong turn shows in what then fits.
                if candidate.inliers > match.inliers + CLEARLY:
                    match = min(match, candidate, key=attrgetter("value"))
        if match.inliers < (self.options.inlier_share if odometry is None else LEAST_SCORE):
            match = self._search(points, prior, match)
        match.pose[2] = wrap(match.pose[2])
        expected = np.diag(1.0 / np.diag(prior.information))
        return self._settle(match.pose, match.hessian - prior.information, expected, match.inliers, points)

    def _predict(self, odometry: Array | None) -> Prior:
        """Where the next scan is expected, in the tracker's frame, and how surely."""
        options, last = self.options, self._poses[-1]
        if odometry is not None and self._odometry is not None:
            step, information = odometry_prior(self._odometry, odometry, options.odometry)
        else:
            step = relative(last, self._poses[0]) / max(len(self._poses) - 1, 1)
            information = odometry_prior(last, compose(last, step), options.steady_motion).information
        # The prior is as sure along the path as across it: no need to turn its information.
        return Prior(compose(last, step), information)

    def _match(self, points: Array, prior: Prior, start: Array) -> Match:
        """The objective's minimum from the pose `start` (3,)."""
        options = self.options
        pose, hessian = start.copy(), np.empty((3, 3))
        value, inliers = match_and_count(
            PairProblem(self.map.grid, self.map.half, points, options.scale, prior),
            pose,
            self._widenings,
            options.max_iterations,
            options.tolerance,
            hessian,
            options.inlier_bound,
        )
        return Match(value, pose, hessian, inliers)

    def _search(self, points: Array, prior: Prior, best: Match) -> Match:
        """The better of what was found and the match from where a search among the last scans leads."""
        clouds = [transform(pose, part) for part, pose, path in self._window if path > self._path - RECENT]
        cloud = np.concatenate(clouds)
        if not len(cloud) or not len(points):
            return best
        field = likelihood_field(cloud, self.options.steady_search)
        found = search(field, points, prior.mean, LEAST_SCORE, self.options.steady_search)
        if found is None:
            return best
        self.searches += 1
        return min(best, self._match(points, prior, found.pose), key=attrgetter("value"))

    def _settle(self, pose: Array, hessian: Array, expected: Array, inliers: float, points: Array) -> Tracked:
        """Take the pose; let the scan join the map when the robot has moved, and old ones leave it."""
        step = relative(pose, self._joined)
        distance = math.hypot(*step[:2].tolist())
        # Before anything was seen there is nothing to move against.
        nothing_seen = self.map.rows == 0
        joined = nothing_seen or distance > self.options.step or abs(step[2]) > self.options.step
        if joined:
            self._path += distance
            self._joined = pose
            self.map.add(points, pose)
            self._window.append((points, pose, self._path))
            while self._window[0][2] < self._path - self.options.window:
                old_points, old_pose, _ = self._window.popleft()
                self.map.subtract(old_points, old_pose)
        self._poses.append(pose)
        return Tracked(pose, hessian, expected, inliers, self._path, joined)
