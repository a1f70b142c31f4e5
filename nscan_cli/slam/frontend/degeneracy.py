"""Step 1 without odometry: a scan keeps to its prediction in a direction of which it tells little.

The walls of a corridor look alike all along. The energy in that direction has only a ripple of some
centimetres, from how points fall into cells. A match ends in its nearest minimum, mostly a little behind. So
the velocity falls, and the robot seems to stop while its corridor goes by. The Hessian gives no warning,
because it describes the ripple.

How well the position is known shows in the objective over all positions that constant velocity allows. Where
it is flat, the scan stays at its prediction, as in a Kalman filter: the closer, the less the scan tells, and
the steadier the robot moves where scans do tell.
"""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.array_assignment import assign, assign_rows
from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.matching.motion_model import Prior
from nscan_cli.matching.pairwise_solver import PairProblem, pairwise_objective
from nscan_cli.matching.small_matrices import information_of_place
from nscan_cli.ndt.association import begin_association
from nscan_cli.ndt.energy import ENERGY_NUMBERS
from nscan_cli.ndt.hash_grid import Grid
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.options import TrackingParameters
from nscan_cli.slam.frontend.scan_to_map import match_and_count
from nscan_cli.slam.frontend.tracked_scans import TrackedScans

NOTHING_TOLD = 1e3
"""Standard deviation of a position of which a match tells nothing, m; that of a scan without any match is
infinite."""


@kernel
def keep_prediction(
    grid: Grid,
    settings: TrackingParameters,
    points: Array,
    prior: Prior,
    mean_square_deviation: Array,
    found: TrackedScans,
    k: int,
) -> None:
    """Move scan k, which was matched, back to its prediction as far as it does not tell its position.

    `points` (m, 2) are its own. `mean_square_deviation` (1,) of scans from their predictions (m²) is updated.
    Writes `weakest_sigmas` of `found`.
    """
    options, pose, along = settings.options.degeneracy, found.poses[k], np.empty(2)
    if weakest_direction(found.hessians[k], along) > options.max_information_ratio:
        x, y = pose[0] - prior.mean[0], pose[1] - prior.mean[1]
        mean_square_deviation[0] += options.smoothing * (0.5 * (x * x + y * y) - mean_square_deviation[0])
        return
    places, values = objective_profile(grid, settings, points, prior, pose, along)
    best = index_of_least(values)
    if values[best] < found.values[k] - options.rematch_gain:
        further = places[best] - distance_ahead(pose, prior, along)
        trial, hessian = pose.copy(), np.empty((3, 3))
        trial[0] += further * along[0]
        trial[1] += further * along[1]
        value, inliers = match_and_count(grid, settings, points, prior, trial, hessian)
        if value < found.values[k] - options.rematch_gain:
            found.values[k], found.inliers[k] = value, inliers
            assign(pose, trial)
            assign_rows(found.hessians[k], hessian)
    off = distance_ahead(pose, prior, along)
    variance = measured_variance(places, values, prior, options.profile_step)
    found.weakest_sigmas[k] = np.sqrt(variance)
    excess = max(variance - options.trusted_sigma**2, 0.0)
    if excess == 0.0:
        mean_square_deviation[0] += options.smoothing * (off * off - mean_square_deviation[0])
    allowed = max(options.min_deviation**2, options.deviation_factor**2 * mean_square_deviation[0])
    back = off * excess / (allowed + excess)
    pose[0] -= back * along[0]
    pose[1] -= back * along[1]


@leaf_kernel
def distance_ahead(pose: Array, prior: Prior, along: Array) -> float:
    """How far (m) a pose (3,) lies ahead of its prediction, in the direction `along` (2,)."""
    return float((pose[0] - prior.mean[0]) * along[0] + (pose[1] - prior.mean[1]) * along[1])


@kernel
def weakest_direction(hessian: Array, along: Array) -> float:
    """Write the direction (2,) with the least information in the Hessian (3, 3) of a pose, its angle free.

    Returns the ratio of that information to the one across.
    """
    xx, xy, yy = information_of_place(hessian)
    middle, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    angle = 0.5 * (np.arctan2(2 * xy, xx - yy) + np.pi)
    along[0], along[1] = np.cos(angle), np.sin(angle)
    return float((middle - radius) / max(middle + radius, 1e-9))


@kernel
def objective_profile(
    grid: Grid, settings: TrackingParameters, points: Array, prior: Prior, pose: Array, along: Array
) -> tuple[Array, Array]:
    """The objective on the line `along` (2,) through `pose` (3,): places (n,), in m ahead of the prediction,
    and its values (n,)."""
    problem = PairProblem(grid, settings.half, begin_association(points), settings.options.scale, prior)
    out, gradient, hessian, there = np.empty(ENERGY_NUMBERS), np.empty(3), np.empty((3, 3)), pose.copy()
    own, options = distance_ahead(pose, prior, along), settings.options.degeneracy
    apart = options.profile_step
    farthest = int(np.ceil(options.profile_sigmas / np.sqrt(prior.information[0, 0]) / apart))
    places, values = np.empty(2 * farthest + 1), np.empty(2 * farthest + 1)
    for at in range(len(places)):
        places[at] = apart * (at - farthest)
        there[0] = pose[0] + (places[at] - own) * along[0]
        there[1] = pose[1] + (places[at] - own) * along[1]
        values[at] = pairwise_objective(problem, there, 1.0, 0.0, out, gradient, hessian)
    return places, values


@kernel
def measured_variance(places: Array, values: Array, prior: Prior, apart: float) -> float:
    """The variance (m²) of the position that a scan itself measures: the prior's part is taken out."""
    expected = entropy_power(0.5 * prior.information[0, 0] * places * places, apart)
    told = 1 / max(entropy_power(values, apart), 1e-12) - 1 / expected
    return 1 / max(told, NOTHING_TOLD**-2)


@leaf_kernel
def index_of_least(values: Array) -> int:
    """The index of the least of some values (n,), the first of several."""
    best = 0
    for k in range(1, len(values)):
        if values[k] < values[best]:
            best = k
    return best


@kernel
def entropy_power(values: Array, apart: float) -> float:
    """The variance (m²) of the Gaussian with the entropy of places `apart` (m), with likelihood exp(−value).

    That of a Gaussian is its variance; a little likelihood far away counts for little.
    """
    weights = np.exp(values[index_of_least(values)] - values)
    weights /= weights.sum()
    entropy = np.log(apart) - (weights * np.log(np.maximum(weights, 1e-300))).sum()
    return float(np.exp(2 * entropy - 1) / (2 * np.pi))
