import numpy as np
import pytest

from nscan_cli.mapping.viewer.viewer_data import notice_places

SCANS = np.arange(0, 100, 2)
"""Of every second scan there is a node."""


@pytest.mark.parametrize(
    ("notice", "places"),
    [
        ("tracking broke at scan 8; the motion to there is unknown", [(4, 4)]),
        ("tracking broke at scans 8, 20; the motion", [(4, 4), (10, 10)]),
        ("the odometry jumps at scans 8, 20 and 3 more; each is", [(4, 4), (10, 10)]),
        ("scans are missing before scan 7: by odometry", [(4, 4)]),
        ("scans 20 to 40 see other things than the keyframes", [(10, 20)]),
        ("7.5 m and 3.6 m from scan 20 to 40; 1 m and 2 m from scan 50 to 60", [(10, 20), (25, 30)]),
        ("from scan 20 to scan 40, another visit", [(10, 20)]),
        ("most of all at scans 20, 40", [(10, 10), (20, 20)]),
        ("scans 4 and 6 contradict each other", [(2, 2), (3, 3)]),
        ("no pose of /odom near scans 0 to 4, scans 10 to 12, scan 961", [(0, 2), (5, 6), (49, 49)]),
        ("odometry is missing at 150 scans (19.2 s)", []),
        ("the log has no odometry", []),
    ],
)
def test_the_scans_that_a_notice_names(notice, places):
    assert notice_places(notice, SCANS) == places
