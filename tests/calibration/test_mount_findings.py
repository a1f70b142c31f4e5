"""Mountings that the file has the wrong way round."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from nscan_cli.poses import inverse
from tests.calibration.test_file_check import found
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
