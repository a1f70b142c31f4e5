"""Step 1 of the loop (paper, V): the pose of every scan by matching it with the map of the last metres.

The map is one NDT that grows by the scans ahead and loses those behind, in a frame of its own: what
loops later correct in the graph never tears it.
"""

from __future__ import annotations

from operator import attrgetter
from typing import NamedTuple

import numpy as np

from nscan_cli.matching.priors import Prior
from nscan_cli.matching.search import likelihood_field, search
from nscan_cli.ndt.grid import Ndt
from nscan_cli.poses import Array
from nscan_cli.slam.found import Found
from nscan_cli.slam.options import TrackingOptions
from nscan_cli.slam.sensed import Sensed
from nscan_cli.slam.settings import Settings
from nscan_cli.slam.track import CLEARLY, ROWS, Track, follow, least_share, match_and_count, take

RECENT = 5.0
"""A lost scan is searched among those of the last stretch of path, m."""
LEAST_SCORE = 0.3
"""What a search must find at least; with fewer inliers a scan is lost, whatever the odometry says."""


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


class Tracker:
    """Follows the robot from scan to scan. `odometry` tells whether there is any.

    Without it each face of a wall on the map is no Gaussian of its own: exact ones hold the robot where it is
    in corridors that come into view, as nothing else does. And the start of a match is a guess: its wide
    stages are done to their end.
    """

    def __init__(self, options: TrackingOptions, odometry: bool = True) -> None:
        self.options = options
        gaussians = options.gaussians
        self.map = Ndt(gaussians.cell, gaussians.minimum, gaussians.floor, capacity=1 << 14, faces=odometry)
        self.restarts = self.searches = 0
        self._settings = Settings.of(options, odometry)
        self._track = Track.begin(options.steady_scans + 1)
        self._prior = Prior(np.zeros(3), np.zeros((3, 3)))

    def track(self, scans: Sensed) -> Found:
        """Where the next scans are found."""
        n, k = len(scans), 0
        points, ends = scans.points, scans.ends
        odometry = np.full((n, 3), np.nan) if scans.odometry is None else scans.odometry
        self._track = self._track.with_room(n, int(ends[-1] - ends[0]))
        found = Found.room(n)
        while k < n:
            self.map.reserve(int(ends[k + 1] - ends[k]))
            self._track.counts[ROWS] = self.map.rows
            track, grid, settings, prior = self._track, self.map.grid, self._settings, self._prior
            k = follow(track, grid, settings, points, ends, odometry, k, prior, found)
            if k < n and np.isfinite(found.inliers[k]):
                match = Match(found.values[k], found.poses[k], found.hessians[k], found.inliers[k])
                least = LEAST_SCORE if np.isfinite(odometry[k, 0]) else self.options.inlier_share
                match = self._match_elsewhere(scans.of(k), match, least)
                found.values[k], found.poses[k], found.hessians[k], found.inliers[k] = match
                take(track, grid, settings, scans.of(k), odometry[k], prior, found, k)
                k += 1
            self.map.rows = int(self._track.counts[ROWS])
        return found

    def _match_elsewhere(self, points: Array, match: Match, least: float) -> Match:
        """The best of a match with too few inliers, and of those from other angles, and of a search.

        It is searched with fewer inliers than `least`.
        """
        start, enough = self._prior.mean, least_share(self._track, self._settings)
        for ring, turns in enumerate(self.options.turns):
            if match.inliers >= (self.options.far_share if ring else enough):
                break
            self.restarts += 1
            for turn in (sign * angle for angle in turns for sign in (1, -1)):
                candidate = self._match(points, start + np.array([0.0, 0.0, turn]))
                # From elsewhere it may slide along a corridor; a wrong turn shows in what then fits.
                if candidate.inliers > match.inliers + CLEARLY:
                    match = min(match, candidate, key=attrgetter("value"))
        return match if match.inliers >= least else self._search(points, match)

    def _match(self, points: Array, start: Array) -> Match:
        """The objective's minimum from the pose `start` (3,)."""
        pose, hessian = start.copy(), np.empty((3, 3))
        value, inliers = match_and_count(self.map.grid, self._settings, points, self._prior, pose, hessian)
        return Match(value, pose, hessian, inliers)

    def _search(self, points: Array, best: Match) -> Match:
        """The better of what was found and the match from where a search among the last scans leads."""
        cloud = self._track.recent(RECENT)
        if not len(cloud) or not len(points):
            return best
        field = likelihood_field(cloud, self.options.steady_search)
        found = search(field, points, self._prior.mean, LEAST_SCORE, self.options.steady_search)
        if found is None:
            return best
        self.searches += 1
        return min(best, self._match(points, found.pose), key=attrgetter("value"))
