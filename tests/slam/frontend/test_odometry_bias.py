"""What is wrong with odometry everywhere alike is learned, and taken out where scans tell nothing."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array, compose, relative
from nscan_cli.slam.frontend.odometry_bias import (
    OdometryBias,
    OdometryBiasOptions,
    learn_bias,
    take_out_bias,
)
from nscan_cli.slam.frontend.odometry_noise import OdometryNoiseOptions
from nscan_cli.slam.frontend.options import ScanTrackingOptions, TrackingOptions
from tests.logs.excerpts import truth_of
from tests.slam.mapped_logs import office_log, poses_of, tracked
from tests.slam.trouble_cases import blind

OPTIONS = OdometryBiasOptions()
PIECE = 4.0
"""m"""


def arc(length: float, turn: float) -> Array:
    """The motion (3,) along an arc of a length (m), which turns by so much in all (rad)."""
    chord = length * np.sinc(0.5 * turn / np.pi)
    return np.array([chord * np.cos(0.5 * turn), chord * np.sin(0.5 * turn), turn])


def learned(scale: float, veer: float, noise: float = 0.01, pieces: int = 20) -> OdometryBias:
    """After pieces of 4 m, straight on, where odometry is longer by a factor and veers (rad/m)."""
    rng, bias = np.random.default_rng(2), OdometryBias.begin()
    for _ in range(pieces):
        by_odometry = arc(scale * PIECE, veer * PIECE) + noise * rng.normal(size=3)
        learn_bias(bias, OPTIONS, arc(PIECE, 0.0), by_odometry, PIECE)
    return bias


def corrected(bias: OdometryBias, step: Array, length: float) -> Array:
    """(3,) a step without the bias."""
    found = step.copy()
    take_out_bias(bias, OPTIONS, found, length)
    return found


@pytest.mark.parametrize("scale", [0.8, 1.1, 1.5])
@pytest.mark.parametrize("veer", [-0.09, 0.05])
def test_length_and_veer_are_taken_out(scale, veer):
    bias = learned(scale, veer)
    assert bias.means == pytest.approx([1 / scale - 1, -veer], abs=0.01)
    step = arc(scale * 0.5, veer * 0.5)
    np.testing.assert_allclose(corrected(bias, step, 0.5), [0.5, 0.0, 0.0], atol=0.006)


@pytest.mark.parametrize(
    "bias",
    [
        pytest.param(learned(1.03, 0.02, 0.001), id="small"),
        pytest.param(learned(1.1, 0.05, pieces=OPTIONS.min_pieces - 1), id="few pieces"),
        pytest.param(learned(1.08, 0.03, 0.8), id="noise"),
    ],
)
def test_odometry_stays_where_its_bias_is_small_or_not_certain(bias):
    step = arc(0.5, 0.3)
    np.testing.assert_array_equal(corrected(bias, step, 0.5), step)


def test_pieces_on_which_the_robot_turned_around_are_left_out():
    bias = OdometryBias.begin()
    learn_bias(bias, OPTIONS, np.array([0.3, 0.0, 0.1]), np.array([0.1, 0.0, 0.0]), PIECE)
    assert bias.pieces[0] == 0.0


def biased(log: LaserLog, scale: float, veer: float) -> LaserLog:
    """The log with odometry that is longer by a factor, and veers (rad/m)."""
    assert log.odometry is not None
    steps = relative(log.odometry[1:], log.odometry[:-1])
    steps[:, 2] += veer * np.hypot(steps[:, 0], steps[:, 1])
    steps[:, :2] *= scale
    poses = [log.odometry[0]]
    for step in steps:
        poses.append(compose(poses[-1], step))
    return dataclasses.replace(log, odometry=np.array(poses), odometry_path=None)


@pytest.mark.parametrize("sigmas", [OPTIONS.sigmas, np.inf])
def test_a_biased_odometry_leads_on_where_no_beam_returns(sigmas):
    """For 6 m, after 70 m: by 10 % and 5° a metre it would be off by 0.7 m and more than 25°."""
    case = blind(biased(office_log(), 1.1, np.radians(5)), 70.0, 76.0)
    noise = OdometryNoiseOptions(bias=OdometryBiasOptions(sigmas=sigmas))
    scan = ScanTrackingOptions(odometry_noise=noise)
    poses, truth = poses_of(tracked(case.log, TrackingOptions(scan=scan))[0]), truth_of(case.log)
    first, last = case.before - 1, case.after - 1
    off = relative(poses[last], poses[first]) - relative(truth[last], truth[first])
    if sigmas < np.inf:
        assert np.hypot(off[0], off[1]) < 0.2
        assert abs(off[2]) < np.radians(3)
    else:
        assert abs(off[2]) > np.radians(20)
