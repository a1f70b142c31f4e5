"""Single scans that were matched off their neighbours."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.poses import Array, compose
from nscan_cli.slam.backend.options import SingleScanOptions
from nscan_cli.slam.backend.single_scan_jumps import without_single_jumps

OPTIONS = SingleScanOptions()
NONE = np.zeros(0, dtype=np.int64)


def path(length: float = 0.05, count: int = 40) -> Array:
    """Poses of a robot that drives a circle."""
    poses = [np.array([1.0, -2.0, 3.0])]
    for _ in range(count - 1):
        poses.append(compose(poses[-1], np.array([length, 0.0, 0.05])))
    return np.stack(poses)


@pytest.mark.parametrize("off", [(-0.09, 0.0, 0.04), (0.02, 0.08, 0.0), (0.0, 0.0, -0.12)])
def test_a_scan_that_jumps_to_and_fro_is_put_between_its_neighbours(off):
    odometry, tracked = path(), path()
    tracked[20] = compose(tracked[20], np.array(off))
    found = without_single_jumps(tracked, odometry, NONE, OPTIONS)
    np.testing.assert_allclose(found, path(), atol=1e-3)


def test_what_odometry_does_not_tell_better_stays():
    tracked = path()
    tracked[20] = compose(tracked[20], np.array([0.1, 0.0, 0.0]))
    jumps = path()
    jumps[20] = tracked[20]
    np.testing.assert_array_equal(without_single_jumps(tracked, jumps, NONE, OPTIONS), tracked)
    np.testing.assert_array_equal(without_single_jumps(tracked, None, NONE, OPTIONS), tracked)
    np.testing.assert_array_equal(without_single_jumps(tracked, path(), np.array([0, 20]), OPTIONS), tracked)
    unknown = path()
    unknown[21] = np.nan
    np.testing.assert_array_equal(without_single_jumps(tracked, unknown, NONE, OPTIONS), tracked)


def test_steps_that_do_not_lead_back_and_long_ones_stay():
    slipped = path()
    slipped[20:] = compose(np.array([0.12, 0.0, 0.0]), slipped[20:])
    np.testing.assert_array_equal(without_single_jumps(slipped, path(), NONE, OPTIONS), slipped)
    far = path(0.3)
    far[20] = compose(far[20], np.array([0.12, 0.0, 0.0]))
    np.testing.assert_array_equal(without_single_jumps(far, path(0.3), NONE, OPTIONS), far)
