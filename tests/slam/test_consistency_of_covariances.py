"""Whether keyframes are as far off as the graph says."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.graph.model import Graph
from nscan_cli.poses import compose, relative, wrap
from nscan_cli.slam.options import SlamOptions
from tests.simulation.drive import Drive, Odometry
from tests.simulation.laser import Laser
from tests.simulation.places import bare_corridors, drive_through
from tests.simulation.scenes import office
from tests.slam.mapped_logs import mapped

SEEDS = (1, 2, 3)
SHORT_RANGE = Laser(
    726, -np.radians(127.5), np.radians(255) / 725, 5.6, noise=0.02, resolution=0.001, dropout=0.01
)


def test_the_marginals_of_the_office_are_calibrated():
    """The noise of the scans and of the odometry is drawn anew for each drive of 246 m. Measured: 0.9."""
    squared = []
    for seed in SEEDS:
        drive = office().record(seed)
        squared += squared_errors(mapped(drive.log(), SlamOptions()).graph, drive.truth)
    assert 0.5 <= np.mean(squared) <= 2


def test_the_marginals_of_bare_corridors_are_calibrated_and_straight_ones_stay_straight():
    """Walls 1 m aside, seen as far as 5.6 m ahead: odometry alone says how far. Measured: 0.8; no bend."""
    squared, turned = [], []
    for seed in SEEDS:
        place = bare_corridors(seed)
        straight = dataclasses.replace(place, waypoints=place.waypoints[:3])
        drive = drive_through(straight, SHORT_RANGE, Drive(0.2, 0.6, 0.1), Odometry(), seed)
        graph = mapped(drive.log(), SlamOptions()).graph
        squared += squared_errors(graph, drive.truth)
        found, true = (relative(poses[-1], poses[0])[2] for poses in (graph.poses, drive.truth))
        turned.append(wrap(found - true))
    assert 0.5 <= np.mean(squared) <= 2
    assert np.mean(turned) == pytest.approx(0.0, abs=np.radians(0.25))


def squared_errors(graph: Graph, truth: np.ndarray) -> list[float]:
    """Of all keyframes, in units of their covariance, per degree of freedom; seen from the first one."""
    squared = []
    first, *others = sorted(graph.marginals)
    for node in others:
        true = compose(graph.poses[first], relative(truth[node], truth[first]))
        off = graph.poses[node] - true
        off[2] = wrap(off[2])
        squared.append(off @ np.linalg.solve(graph.marginals[node], off) / 3)
    return squared
