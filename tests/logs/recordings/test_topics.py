"""Which topics of a recording are used: the ones asked for, or the only ones."""

from __future__ import annotations

import dataclasses

import pytest

from nscan_cli.errors import WrongUsageError
from nscan_cli.logs.device_choice import OpenChoiceError
from nscan_cli.logs.frame_names import FrameNames
from tests.logs.recordings.messages import PERIOD, START, Odom, Scan, Tf, Written, drive, turned


def on(topic: str, kind: type) -> list[Written]:
    """The messages of a drive that are of a kind, on another topic."""
    return [dataclasses.replace(one, topic=topic) for one in drive() if isinstance(one.content, kind)]


def in_order(written: list[Written]) -> list[Written]:
    return sorted(written, key=lambda one: one.log_time)


@pytest.mark.parametrize(("there", "asked"), [("/scan", "scan"), ("scan", "/scan"), ("scan", "scan")])
def test_a_slash_in_front_of_a_topic_makes_no_difference(read, there, asked):
    written = in_order(drive(scan_topic=there, odom_topic=there.replace("scan", "odom")) + on("/rear", Scan))
    log = read(written, topic=asked, odom_topic=asked.replace("scan", "odom"))
    assert log.laser == there
    assert log.odometry is not None


def test_where_there_are_both_the_slash_chooses(read):
    written = in_order(drive() + on("scan", Scan)[:5])
    assert len(read(written, topic="scan")) == 5
    assert len(read(written, topic="/scan")) == 12


def test_several_lasers_or_odometries_are_named(read):
    written = in_order(drive() + on("/rear", Scan) + on("/wheels", Odom))
    with pytest.raises(
        OpenChoiceError, match=r"/rear \(12 messages\), /scan .*; choose one by --topic"
    ) as open_laser:
        read(written)
    assert (open_laser.value.what, open_laser.value.chooses) == ("laser", "topic")
    assert [one.name for one in open_laser.value.devices] == ["/rear", "/scan"]
    with pytest.raises(
        OpenChoiceError, match=r"/odom \(13 messages\), /wheels .*; choose one by --odom-topic"
    ):
        read(written, topic="/scan")
    assert read(written, topic="/scan", odom_topic="/wheels").odometry is not None
    assert read(written, topic="/scan", odometry=False).odometry is None
    with pytest.raises(
        WrongUsageError, match=r"has no topic /front; --topic can be /rear \(12 messages\), /scan"
    ):
        read(written, topic="/front")


def test_a_frame_of_tf_can_be_chosen_as_odometry(read):
    """Two robots in one recording, neither of which has a topic for its odometry."""
    written = drive(odom_topic=None, mount=())
    for name, speed in (("a/base_link", 0.1), ("b/base_link", 0.2)):
        written += [
            Written(
                "/tf",
                START + k * PERIOD,
                (Tf(START + k * PERIOD, "odom", name, (speed * k, 0, 0), turned()),),
            )
            for k in range(13)
        ]
    with pytest.raises(
        OpenChoiceError, match=r"a/base_link \(13 transforms\), b/base_link .* by --odom-topic"
    ):
        read(in_order(written))
    log = read(in_order(written), odom_topic="b/base_link")
    assert log.odometry is not None
    assert log.odometry[-1, 0] == pytest.approx(0.2 * 11.5, abs=1e-6)
    assert log.frames == FrameNames("laser", "b/base_link", "odom")
