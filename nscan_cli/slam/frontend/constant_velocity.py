"""Step 1 without odometry: where nothing tells how far a scan has come along, the robot goes on as it did.

Walls of a corridor look alike all along. What is left of the energy in that direction is a ripple, of some
centimetres, from how points fall into cells. A match ends in its nearest minimum, mostly a little behind;
what comes then is expected a little behind as well, and the robot slows down until it stands, while its
corridor goes by. The Hessian is no warning: it knows the ripple alone.

How well the way is known shows in the objective farther off, over all that steady motion allows. Where that
is flat, the scan stays where it is expected, as a Kalman filter has it: the less it tells, the more so, and
the steadier the robot goes where scans do tell.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.assign import assign, assign_rows
from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.matching.pairwise_solver import PairProblem, pairwise_objective
from nscan_cli.matching.priors import Prior
from nscan_cli.ndt.association import begin_association
from nscan_cli.ndt.energy import ENERGY_NUMBERS
from nscan_cli.ndt.hash_grid import Grid
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.scan_to_map import match_and_count
from nscan_cli.slam.frontend.tracked_scans import TrackedScans
from nscan_cli.slam.frontend.tracking_parameters import TrackingParameters

WEAK = 0.12
"""A direction is looked into that has less than such a share of the information of the one across it."""
SPAN = 2.5
"""Up to so many standard deviations of steady motion off what is expected,"""
APART = 0.03
"""at places so far apart (m): no wall's Gaussian is narrower."""
RIVAL = 3.0
"""A scan is matched from another place as well whose objective is lower by so much."""
TOLD = 0.04
"""m; a scan that tells the way along as well as that is believed."""
LEAST_UNSTEADY, TIMES = 0.03, 3.5
"""How far (m) a scan may be off steady motion at least, and how many times as far as scans usually are;"""
UNSTEADY, LEARNED = 0.05, 0.02
"""which is so much (m) at first, and each scan that tells has such a share in it."""


@kernel
def constant_velocity(
    grid: Grid,
    settings: TrackingParameters,
    points: Array,
    prior: Prior,
    unsteady: Array,
    found: TrackedScans,
    k: int,
) -> None:
    """Let scan k, which was matched, go on as expected as far as it does not tell its way along.

    `points` (m, 2) are its own, `unsteady` (1,) is the mean square (m²) of how far scans are found off what
    the `prior` expects; it learns.
    """
    pose, along = found.poses[k], np.empty(2)
    if weakest_direction(found.hessians[k], along) > WEAK:
        x, y = pose[0] - prior.mean[0], pose[1] - prior.mean[1]
        unsteady[0] += LEARNED * (0.5 * (x * x + y * y) - unsteady[0])
        return
    places, values = profile(grid, settings, points, prior, pose, along)
    best = np.argmin(values)
    if values[best] < found.values[k] - RIVAL:
        further = places[best] - ahead(pose, prior, along)
        _match_from(grid, settings, points, prior, further, along, found, k)
    off, untold = ahead(pose, prior, along), max(told_within(places, values, prior) - TOLD**2, 0.0)
    if untold == 0.0:
        unsteady[0] += LEARNED * (off * off - unsteady[0])
    allowed = max(LEAST_UNSTEADY**2, TIMES**2 * unsteady[0])
    back = off * untold / (allowed + untold)
    pose[0] -= back * along[0]
    pose[1] -= back * along[1]


@leaf_kernel
def ahead(pose: Array, prior: Prior, along: Array) -> float:
    """How far (m) a pose (3,) lies ahead of what the prior expects, in the direction `along` (2,)."""
    return float((pose[0] - prior.mean[0]) * along[0] + (pose[1] - prior.mean[1]) * along[1])


@kernel
def weakest_direction(hessian: Array, along: Array) -> float:
    """Write the direction (2,) of which the Hessian (3, 3) of a pose tells least, whatever the angle is.

    Returns what it tells of it, as a share of what it tells across.
    """
    turn = max(hessian[2, 2], 1e-9)
    xx = hessian[0, 0] - hessian[0, 2] * hessian[0, 2] / turn
    xy = hessian[0, 1] - hessian[0, 2] * hessian[1, 2] / turn
    yy = hessian[1, 1] - hessian[1, 2] * hessian[1, 2] / turn
    middle, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    angle = 0.5 * (np.arctan2(2 * xy, xx - yy) + np.pi)
    along[0], along[1] = np.cos(angle), np.sin(angle)
    return float((middle - radius) / max(middle + radius, 1e-9))


@kernel
def profile(
    grid: Grid, settings: TrackingParameters, points: Array, prior: Prior, pose: Array, along: Array
) -> tuple[Array, Array]:
    """The objective on the line through `pose` (3,) that runs `along` (2,): places (n,) and its values (n,).

    The places are how far (m) they lie ahead of what the prior expects.
    """
    problem = PairProblem(grid, settings.half, begin_association(points), settings.scale, prior)
    out, gradient, hessian, there = np.empty(ENERGY_NUMBERS), np.empty(3), np.empty((3, 3)), pose.copy()
    own, farthest = ahead(pose, prior, along), int(np.ceil(SPAN / np.sqrt(prior.information[0, 0]) / APART))
    places, values = np.empty(2 * farthest + 1), np.empty(2 * farthest + 1)
    for at in range(len(places)):
        places[at] = APART * (at - farthest)
        there[0] = pose[0] + (places[at] - own) * along[0]
        there[1] = pose[1] + (places[at] - own) * along[1]
        values[at] = pairwise_objective(problem, there, 1.0, 0.0, out, gradient, hessian)
    return places, values


@kernel
def told_within(places: Array, values: Array, prior: Prior) -> float:
    """The variance (m²) within which a scan itself tells its place, without what the prior has in it."""
    expected = entropy_power(0.5 * prior.information[0, 0] * places * places)
    told = 1 / max(entropy_power(values), 1e-12) - 1 / expected
    return 1 / max(told, 1e-6)


@kernel
def entropy_power(values: Array) -> float:
    """The variance (m²) of the Gaussian with the entropy of places APART, as likely as exp(−value).

    That of a Gaussian is its variance; a little likelihood far away counts for little.
    """
    weights = np.exp(values.min() - values)
    weights /= weights.sum()
    entropy = np.log(APART) - (weights * np.log(np.maximum(weights, 1e-300))).sum()
    return float(np.exp(2 * entropy - 1) / (2 * np.pi))


@kernel
def _match_from(
    grid: Grid,
    settings: TrackingParameters,
    points: Array,
    prior: Prior,
    further: float,
    along: Array,
    found: TrackedScans,
    k: int,
) -> None:
    """Match scan k from `further` (m) along as well; it stays there if its objective is so much lower."""
    pose, hessian = found.poses[k].copy(), np.empty((3, 3))
    pose[0] += further * along[0]
    pose[1] += further * along[1]
    value, inliers = match_and_count(grid, settings, points, prior, pose, hessian)
    if value < found.values[k] - RIVAL:
        found.values[k], found.inliers[k] = value, inliers
        assign(found.poses[k], pose)
        assign_rows(found.hessians[k], hessian)
