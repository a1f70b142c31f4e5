"""Mountings that the file has the wrong way round, and odometry that is mirrored and counts backward."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.calibration.file_check import checked_file
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import inverse, relative
from tests.calibration.test_file_check import drive, found
from tests.slam.keyframe_drives import round_scene


@pytest.mark.parametrize("turned", [np.pi / 2, -0.8, 2.4])
def test_a_transform_the_wrong_way_round(turned):
    """The file says where the laser sees the robot."""
    mount = np.array([0.3, 0.1, turned])
    scene = round_scene()
    log = scene.record_at(scene.truth(), 5, replace(scene.laser, mount=tuple(mount.tolist()))).log()
    assert found(log) == []
    (said,) = found(replace(log, mount=inverse(mount)))
    assert re.search(rf"the wrong way round,.*try --mount 0.3,0.1,{np.degrees(turned):g};", said)


def test_odometry_with_x_and_headings_reversed_agrees_meanwhile():
    """It is the mirror image of a drive, and counts forward as backward."""
    log = drive()
    assert log.odometry is not None
    checked = checked_file(
        replace(log, odometry=log.odometry * (-1.0, 1.0, -1.0)), ReadingOptions(), FileCheckOptions()
    )
    assert "in the wrong order" in checked.messages[0]
    assert "counts forward as backward" in checked.messages[1]
    assert checked.log.odometry is not None
    steps, right = (relative(poses[10:], poses[:-10]) for poses in (checked.log.odometry, log.odometry))
    np.testing.assert_allclose(steps, right, atol=0.03)
