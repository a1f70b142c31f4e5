"""What the kernels of tracking work on: the local map, some scans, and what is found of them."""

from __future__ import annotations

from typing import NamedTuple

from nscan_cli.matching.motion_model import Prior
from nscan_cli.ndt.hash_grid import Grid
from nscan_cli.poses import Array, Indices
from nscan_cli.slam.frontend.options import TrackingParameters
from nscan_cli.slam.frontend.track_state import TrackState
from nscan_cli.slam.frontend.tracked_scans import TrackedScans


class TrackingProblem(NamedTuple):
    """n successive scans that are tracked, one after another."""

    track: TrackState
    grid: Grid
    """The Gaussians of the local map."""
    settings: TrackingParameters
    points: Array
    """(P, 2) one scan after another, each in its robot's frame. They are corrected in place."""
    ends: Indices
    """(n + 1,) scan k has points[ends[k] : ends[k + 1]]."""
    shares: Array
    """(P,) times of the points as in ScanBatch; empty if there is nothing to correct."""
    times: Array
    """(n,) s"""
    odometry: Array
    """(n, 3) poses, nan where there is none."""
    prior: Prior
    """The prior of the scan that is matched now; each scan overwrites it."""
    found: TrackedScans
    """What is found of the n scans, to be filled."""
