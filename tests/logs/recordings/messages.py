"""What a small robot would record, for tests; other modules write it in every form."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from nscan_cli.logs.laser_log import LaserLog

S = 10**9
START = 1_700_000_000 * S + 123_456_789
PERIOD = S // 10
COUNT = 12
"""Scans of drive()."""
LEVEL = (0.0, 0.0, 0.0, 1.0)


class Scan(NamedTuple):
    stamp: int
    """ns"""
    ranges: Any
    frame: str = "laser"
    angle_min: float = -1.0
    step: float = 0.5
    range_min: float = 0.1
    range_max: float = 30.0
    last: float | None = None
    """rad, what the message says of its last beam; None: where it is."""

    @property
    def angle_max(self) -> float:
        end = self.angle_min + self.step * (len(self.ranges) - 1)
        return end if self.last is None else self.last


class Odom(NamedTuple):
    stamp: int
    x: float
    y: float
    yaw: float
    child: str = "base_link"


class Tf(NamedTuple):
    stamp: int
    parent: str
    child: str
    xyz: tuple[float, float, float]
    quaternion: tuple[float, float, float, float] = LEVEL


Content = Scan | Odom | tuple[Tf, ...]


@dataclass(frozen=True)
class Written:
    """One message: its topic, when it was recorded (ns), and what it says."""

    topic: str
    log_time: int
    content: Content

    def with_scan(self, **changes: Any) -> Written:
        """The same with other fields in its scan."""
        assert isinstance(self.content, Scan)
        return replace(self, content=self.content._replace(**changes))


def turned(yaw: float = 0.0, roll: float = 0.0, pitch: float = 0.0) -> tuple[float, float, float, float]:
    """The quaternion (x, y, z, w) of Rz(yaw)·Ry(pitch)·Rx(roll)."""
    cy, sy, cp, sp, cr, sr = (f(a / 2) for a in (yaw, pitch, roll) for f in (math.cos, math.sin))
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


MOUNT = Tf(START, "base_link", "laser", (0.2, 0.1, 0.5), turned(yaw=0.3))


def drive(
    count: int = COUNT,
    *,
    mount: Iterable[Tf] = (MOUNT,),
    odom_topic: str | None = "/odom",
    odom_in_tf: bool = False,
    scan_topic: str = "/scan",
    beams: int = 5,
) -> list[Written]:
    """A robot that drives along x at 1 m/s and turns by 0.1 rad/s; scans lie midway between odometry."""
    written: list[Written] = []
    statics = tuple(mount)
    if statics:
        written.append(Written("/tf_static", START, statics))
    for k in range(count + 1):
        at = START + k * PERIOD
        x, yaw = 0.1 * k, 0.01 * k
        if odom_topic is not None:
            written.append(Written(odom_topic, at, Odom(at, x, 0.0, yaw)))
        if odom_in_tf:
            written.append(Written("/tf", at, (Tf(at, "odom", "base_link", (x, 0.0, 0.0), turned(yaw)),)))
        if k < count:
            between = at + PERIOD // 2
            ranges = np.linspace(1.0 + 0.01 * k, 3.0, beams).astype(np.float32)
            written.append(Written(scan_topic, between + 7, Scan(between, ranges)))
    return written


def with_scans(**changes) -> list[Written]:
    """drive() with other fields in its scans."""
    return [one.with_scan(**changes) if isinstance(one.content, Scan) else one for one in drive()]


def check_drive(log: LaserLog) -> None:
    """The log is that of drive()."""
    stamps = [START + k * PERIOD + PERIOD // 2 for k in range(COUNT)]
    assert log.stamps == tuple(f"{stamp // S}.{stamp % S:09d}" for stamp in stamps)
    assert log.numbers.tolist() == list(range(COUNT))
    expected = [np.linspace(1.0 + 0.01 * k, 3.0, 5).astype(np.float32) for k in range(COUNT)]
    np.testing.assert_array_equal(log.ranges, expected)
    np.testing.assert_allclose(log.angle_min, -1.0)
    np.testing.assert_allclose(log.angle_increment, 0.5)
    np.testing.assert_allclose(log.mount, (0.2, 0.1, 0.3), atol=1e-9)
    # Midway between odometry at 0.1 k and 0.1 (k + 1) m; times are known to 0.24 µs.
    assert log.odometry is not None
    middle = np.arange(COUNT) + 0.5
    truth = np.stack([0.1 * middle, 0 * middle, 0.01 * middle], axis=-1)
    np.testing.assert_allclose(log.odometry, truth, atol=1e-6)
    assert log.report.skipped == {}
    assert log.report.warnings == ()
    assert log.report.used["odometry"] == "/odom, the only topic with odometry, interpolated"
    assert log.report.used["mounting"] == "tf base_link → laser"
