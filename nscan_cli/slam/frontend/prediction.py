"""The prediction of the next scan's pose: odometry as a prior of its match, else constant velocity."""

from __future__ import annotations

import numpy as np

from nscan_cli.kernels.decorators import kernel
from nscan_cli.matching.motion_model import MotionModel, Prior, motion_sigmas
from nscan_cli.matching.pose_kernels import composed_pose, relative_pose, wrapped
from nscan_cli.poses import Array
from nscan_cli.slam.frontend.constant_velocity import constant_velocity
from nscan_cli.slam.frontend.odometry_bias import take_out_bias
from nscan_cli.slam.frontend.odometry_noise import learned_shares
from nscan_cli.slam.frontend.options import ScanTrackingOptions
from nscan_cli.slam.frontend.track_state import TrackState


@kernel
def predict_prior(
    track: TrackState,
    options: ScanTrackingOptions,
    time: float,
    odometry: Array,
    motion: MotionModel,
    prior: Prior,
) -> None:
    """Write the prior on the next scan's pose, in the tracker's frame; its odometry (3,) may be nan.

    What is known of the bias of the odometry is taken out.
    `motion` has the deviations of the odometry.
    """
    last, step = track.poses[-1], np.empty(3)
    if np.isfinite(odometry[0]) and np.isfinite(track.odometry[0]):
        relative_pose(odometry, track.odometry, step)
        length = np.hypot(step[0], step[1])
        take_out_bias(track.odometry_noise.bias, options.odometry_noise.bias, step, length)
        along, about = motion_sigmas(step, motion)
    else:
        # The step to a lost scan is a guess, and tells no velocity by itself.
        was_lost = track.inliers[0] < options.lost_inliers
        constant_velocity(track, options, time, was_lost, step)
        along, about = motion_sigmas(step, options.constant_velocity)
    composed_pose(last, step, prior.mean)
    prior.mean[2] = wrapped(prior.mean[2])
    # The same variance along the path as across it: the information needs no rotation.
    prior.information[:, :] = 0.0
    prior.information[0, 0] = prior.information[1, 1] = along**-2
    prior.information[2, 2] = about**-2


@kernel
def predict_prior_by_trusted_odometry(
    track: TrackState, options: ScanTrackingOptions, time: float, odometry: Array, prior: Prior
) -> None:
    """Write the prior as `predict_prior` does, with the deviations of trusted odometry, narrowed by what was
    learned."""
    predict_prior(track, options, time, odometry, options.trusted_odometry, prior)
    if np.isfinite(odometry[0]) and np.isfinite(track.odometry[0]):
        step, noise = np.empty(3), options.odometry_noise
        relative_pose(odometry, track.odometry, step)
        length = max(np.hypot(step[0], step[1]), options.match_motion)
        length += abs(wrapped(step[2])) * noise.turn_arm
        along, about = prior.information[0, 0] ** -0.5, prior.information[2, 2] ** -0.5
        shares = learned_shares(track.odometry_noise, noise, length, along, about)
        prior.information[0, 0] = prior.information[1, 1] = (along * shares[0]) ** -2
        prior.information[2, 2] = (about * shares[1]) ** -2


@kernel
def predict_prior_steadily(
    track: TrackState, options: ScanTrackingOptions, time: float, prior: Prior
) -> None:
    """Move the prior without odometry to where the mean velocity of all last steps leads."""
    step = np.empty(3)
    constant_velocity(track, options, time, True, step)
    composed_pose(track.poses[-1], step, prior.mean)
    prior.mean[2] = wrapped(prior.mean[2])


@kernel
def contradicts(prior: Prior, pose: Array, sigmas: float) -> bool:
    """Whether a pose (3,) is more than `sigmas` standard deviations off its prior, in place or in angle."""
    off = np.hypot(pose[0] - prior.mean[0], pose[1] - prior.mean[1])
    turned = wrapped(pose[2] - prior.mean[2])
    return bool(
        off * off * prior.information[0, 0] > sigmas * sigmas
        or turned * turned * prior.information[2, 2] > sigmas * sigmas
    )
