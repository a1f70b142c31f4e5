"""Scans as tracking takes them, in their order and from the last to the first."""

from __future__ import annotations

import numpy as np

from nscan_cli.slam.frontend.scan_batch import ScanBatch

ENDS = np.array([0, 2, 3, 6])


def batch() -> ScanBatch:
    points = np.arange(12.0).reshape(6, 2)
    return ScanBatch(5, points, ENDS, np.array([1.0, 2.0, 4.0]), None, np.arange(6.0))


def test_backwards_the_last_scan_is_the_first_and_time_goes_on():
    poses = np.arange(9.0).reshape(3, 3)
    back = batch().backwards(poses)
    assert [back.of(k).tolist() for k in range(3)] == [batch().of(k).tolist() for k in (2, 1, 0)]
    assert back.times.tolist() == [-4.0, -2.0, -1.0]
    assert back.shares.tolist() == [-3.0, -4.0, -5.0, -2.0, -0.0, -1.0]
    assert back.odometry is not None
    assert back.odometry.tolist() == poses[::-1].tolist()


def test_backwards_the_arrays_are_of_the_types_that_kernels_are_compiled_for():
    """For views in the other order, tracking was compiled a second time: 20 s in the first run of a log."""
    back = batch().backwards(np.zeros((3, 3)))
    for array in (back.points, back.ends, back.times, back.shares, back.odometry):
        assert array is not None
        assert array.flags.c_contiguous
