"""What Foxglove's messages leave open: null readings, poses of scans, fields that are not there."""

from __future__ import annotations

import io
import json
import math
from typing import Any

import numpy as np
import pytest
from mcap.writer import Writer

from nscan_cli.errors import InputDataError
from nscan_cli.logs.laser_log import LaserLog
from tests.logs.recordings.messages import turned


@pytest.fixture
def read_scans(read):
    def read_them(*scans: Any, **options) -> LaserLog:
        """The log of scans that are JSON objects, a second apart."""
        out = io.BytesIO()
        writer = Writer(out)
        writer.start()
        schema = writer.register_schema("foxglove.LaserScan", "jsonschema", b"{}")
        channel = writer.register_channel("/scan", "json", schema)
        for k, scan in enumerate(scans):
            writer.add_message(channel, (k + 1) * 10**9, json.dumps(scan).encode(), 0)
        writer.finish()  # type: ignore[no-untyped-call]
        log: LaserLog = read(out.getvalue(), **options)
        return log

    return read_them


def scan(sec: int = 1, **more: Any) -> dict[str, Any]:
    fields = {
        "timestamp": {"sec": sec, "nsec": 5},
        "frame_id": "base_link",
        "start_angle": -1,
        "end_angle": 1,
    }
    return fields | {"ranges": [1, None, 3]} | more


def test_both_ends_are_beams_and_null_is_no_reading(read_scans):
    log = read_scans(scan(1), scan(2))
    assert log.stamps == ("1.000000005", "2.000000005")
    np.testing.assert_array_equal(log.angle_min, [-1, -1])
    np.testing.assert_array_equal(log.angle_increment, [1, 1])
    np.testing.assert_array_equal(log.ranges, np.array([[1, math.nan, 3]] * 2, dtype=np.float32))


def pose(x: float, y: float, yaw: float, roll: float = 0.0) -> dict[str, Any]:
    quaternion = dict(zip("xyzw", turned(yaw, roll), strict=True))
    return {"position": {"x": x, "y": y, "z": 0.3}, "orientation": quaternion}


def test_the_pose_of_the_scans_is_part_of_the_mounting(read_scans):
    log = read_scans(scan(1, pose=pose(0.5, 0.25, 0.1)), scan(2, pose=pose(0.5, 0.25, 0.1)))
    np.testing.assert_allclose(log.mount, (0.5, 0.25, 0.1), atol=1e-9)
    hanging = read_scans(scan(1, pose=pose(0.5, 0.25, 0.1, math.pi)))
    np.testing.assert_array_equal(hanging.angle_min, [1])
    with pytest.raises(InputDataError, match=r"tilted by 5\.7°"):
        read_scans(scan(1, pose=pose(0, 0, 0, 0.1)))
    with pytest.raises(
        InputDataError,
        match=r"its laser slides, by up to 0.50 m to either side: the pose in its scans moves; .*--mount",
    ):
        read_scans(scan(1, pose=pose(0, 0, 0)), scan(2, pose=pose(1, 0, 0)))
    moving = read_scans(scan(1, pose=pose(0, 0, 0)), scan(2, pose=pose(1, 0, 0)), mount=(0.0, 0.0, 0.0))
    assert len(moving) == 2


def test_other_names_for_times_and_no_time_at_all(read_scans):
    assert read_scans(scan(1, timestamp={"seconds": 7, "nanos": 1})).stamps == ("7.000000001",)
    without = scan()
    del without["timestamp"]
    assert read_scans(without, without).stamps == ("1.000000000", "2.000000000")


@pytest.mark.parametrize(
    "wrong",
    [
        [], {}, 5, None, scan(ranges=[[1, 2], [3, 4]]), scan(ranges="abc"), scan(start_angle="left"),
        scan(timestamp={"sec": 10**30}), scan(frame_id=5), scan(pose={"position": {"x": "far"}}),
        scan(start_angle=1e300),
    ],
)  # fmt: skip
def test_what_is_no_scan_is_counted(read_scans, wrong):
    log = read_scans(scan(1), wrong, scan(3))
    assert len(log) == 2
    ((count, first),) = log.report.skipped.values()
    assert (count, first) == (1, 2)
