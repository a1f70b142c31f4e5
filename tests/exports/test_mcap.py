"""Our MCAP recordings, read back by the readers of mcap and mcap-ros2-support."""

from __future__ import annotations

import dataclasses
import io
from collections import defaultdict
from typing import Any

import numpy as np
import pytest

from nscan_cli.exports.mcap import TOPICS, ros2_recording
from nscan_cli.exports.ros_messages import MessageFactory, scan_message
from nscan_cli.graph.model import Graph
from nscan_cli.logs.frame_names import FrameNames
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.mapping.occupancy import OccupancyGrid, occupancy_grid
from nscan_cli.poses import Array, compose, relative
from tests.exports.small_run import POSES, small_log, small_run_graph

reader = pytest.importorskip("mcap.reader", reason="mcap is not installed: pip install nscan-cli[test]")
decoder = pytest.importorskip(
    "mcap_ros2.decoder", reason="mcap-ros2-support is not installed: pip install nscan-cli[test]"
)
NODES = np.arange(5)


def grid_of(log: LaserLog) -> OccupancyGrid:
    return occupancy_grid(log, NODES, POSES, 0.1)


def read_back(data: bytes) -> dict[str, list[tuple[int, Any]]]:
    """Topic → (log time, message) in order of time; every message decoded, every checksum verified."""
    found = defaultdict(list)
    file = reader.make_reader(
        io.BytesIO(data), validate_crcs=True, decoder_factories=[decoder.DecoderFactory()]
    )
    for _schema, channel, message, decoded in file.iter_decoded_messages():
        found[channel.topic].append((message.log_time, decoded))
    return found


@pytest.fixture(scope="module")
def run() -> tuple[LaserLog, Graph, bytes]:
    """A log, its graph, and the recording of both."""
    log = small_log()
    graph = small_run_graph(log)
    return log, graph, ros2_recording(log, NODES, NODES, graph, grid_of(log))


@pytest.fixture(scope="module")
def topics(run) -> dict[str, list[tuple[int, Any]]]:
    return read_back(run[2])


def pose_of(translation: Any, rotation: Any) -> Array:
    assert (translation.z, rotation.x, rotation.y) == (0, 0, 0)
    return np.array([translation.x, translation.y, 2 * np.arctan2(rotation.z, rotation.w)])


def frames_at(topics: dict[str, list[tuple[int, Any]]], k: int) -> dict[tuple[str, str], Array]:
    """(parent, child) → pose of the child, from the k-th /tf and from /tf_static."""
    links = [*topics["/tf"][k][1].transforms, *topics["/tf_static"][0][1].transforms]
    return {
        (link.header.frame_id, link.child_frame_id): pose_of(
            link.transform.translation, link.transform.rotation
        )
        for link in links
    }


def stamp(message: Any) -> int:
    nanoseconds: int = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
    return nanoseconds


def test_the_file_is_a_ros_2_recording_with_its_schemas(run):
    file = reader.make_reader(io.BytesIO(run[2]), validate_crcs=True)
    assert file.get_header().profile == "ros2"
    summary = file.get_summary()
    assert {chunk.compression for chunk in summary.chunk_indexes} == {"zstd"}
    types = {}
    for channel in summary.channels.values():
        schema = summary.schemas[channel.schema_id]
        assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
        types[channel.topic] = schema.name
    assert types == TOPICS
    marker = next(s for s in summary.schemas.values() if s.name == "visualization_msgs/msg/MarkerArray")
    # The types that a type is made of follow it, as the registry of MCAP asks.
    assert b"\nMSG: visualization_msgs/Marker\n" in marker.data
    assert b"\nMSG: builtin_interfaces/Duration\n" in marker.data


def test_every_topic_is_there_and_every_message_decodes(topics):
    counts = {topic: len(messages) for topic, messages in topics.items()}
    assert counts == {"/map": 1, "/path": 1, "/graph": 1, "/tf_static": 1, "/tf": 5, "/scan": 5}


def test_every_channel_says_which_quality_of_service_the_player_offers(run, tmp_path):
    """As a reader of rosbag2's own format takes it."""
    from rosbags.highlevel import AnyReader
    from rosbags.interfaces import ConnectionExtRosbag2, QosDurability, QosHistory, QosReliability

    path = tmp_path / "out.mcap"
    path.write_bytes(run[2])
    with AnyReader([path]) as bag:
        offers = {each.topic: each.ext for each in bag.connections}
    assert set(offers) == set(TOPICS)
    for topic, offer in offers.items():
        assert isinstance(offer, ConnectionExtRosbag2)
        (profile,) = offer.offered_qos_profiles
        kept = topic not in ("/tf", "/scan")
        durability = QosDurability.TRANSIENT_LOCAL if kept else QosDurability.VOLATILE
        assert (profile.durability, profile.reliability) == (durability, QosReliability.RELIABLE)
        assert (profile.history, profile.depth >= 1) == (QosHistory.KEEP_LAST, True)
        assert profile.deadline == profile.lifespan == (9223372036, 854775807)


def test_stamps_are_those_of_the_log_to_the_nanosecond(topics):
    expected = [
        976052896784509000,
        976052897784509001,
        976052898250000000,
        976052899000000000,
        976052899500000000,
    ]
    assert [time for time, _ in topics["/scan"]] == expected
    assert [stamp(scan) for _, scan in topics["/scan"]] == expected
    assert [stamp(tf.transforms[0]) for _, tf in topics["/tf"]] == expected
    assert [stamp(pose) for pose in topics["/path"][0][1].poses] == expected
    for topic in ("/map", "/path", "/graph", "/tf_static"):
        assert topics[topic][0][0] == expected[0]


def test_the_map_has_the_states_and_the_place_of_the_grid(run, topics):
    grid, message = grid_of(run[0]), topics["/map"][0][1]
    assert (message.info.height, message.info.width) == grid.hits.shape
    np.testing.assert_array_equal(np.array(message.data), grid.states().ravel())
    assert message.info.resolution == np.float32(0.1)
    origin = message.info.origin
    np.testing.assert_allclose(pose_of(origin.position, origin.orientation), [*grid.origin, 0])
    assert message.header.frame_id == "map"


def test_scans_are_those_of_the_log(run, topics):
    log = run[0]
    for k, (_, scan) in enumerate(topics["/scan"]):
        np.testing.assert_array_equal(np.array(scan.ranges, dtype=np.float32), log.ranges[k])
        assert scan.header.frame_id == "laser"
        angles = scan.angle_min + scan.angle_increment * np.arange(181)
        np.testing.assert_allclose(angles, np.radians(np.arange(-90, 91)), atol=1e-5)
        assert scan.angle_max == pytest.approx(np.pi / 2)
        assert (scan.range_min, scan.range_max) == log.range_limits


def test_the_frames_lead_from_the_map_to_the_laser(run, topics):
    log = run[0]
    for k, pose in enumerate(POSES):
        frames = frames_at(topics, k)
        assert set(frames) == {("map", "odom"), ("odom", "base_link"), ("base_link", "laser")}
        np.testing.assert_allclose(relative(frames["odom", "base_link"], log.odometry[k]), 0, atol=1e-9)
        robot = compose(frames["map", "odom"], frames["odom", "base_link"])
        laser = compose(robot, frames["base_link", "laser"])
        np.testing.assert_allclose(relative(laser, log.laser_pose(pose)), 0, atol=1e-9)


def test_where_odometry_is_missing_the_correction_before_holds(run):
    """The robot has one parent frame throughout, and is where the graph has it."""
    odometry = run[0].odometry.copy()
    odometry[[0, 3]] = np.nan
    log = dataclasses.replace(run[0], odometry=odometry)
    topics = read_back(ros2_recording(log, NODES, NODES, small_run_graph(log), grid_of(log)))
    found = [frames_at(topics, k) for k in range(len(POSES))]
    for k, after in ((0, 1), (3, 2)):
        np.testing.assert_allclose(
            relative(found[k]["map", "odom"], found[after]["map", "odom"]), 0, atol=1e-9
        )
        robot = compose(found[k]["map", "odom"], found[k]["odom", "base_link"])
        np.testing.assert_allclose(relative(robot, POSES[k]), 0, atol=1e-9)


def test_without_odometry_there_is_no_odom_frame(run):
    log = dataclasses.replace(run[0], odometry=None)
    graph = small_run_graph(log)
    frames = frames_at(read_back(ros2_recording(log, NODES, NODES, graph, grid_of(log))), 4)
    assert set(frames) == {("map", "base_link"), ("base_link", "laser")}
    np.testing.assert_allclose(relative(frames["map", "base_link"], POSES[4]), 0, atol=1e-9)


def test_the_path_has_the_poses_of_the_graph(topics):
    found = [pose_of(each.pose.position, each.pose.orientation) for each in topics["/path"][0][1].poses]
    np.testing.assert_allclose(relative(np.array(found), POSES), 0, atol=1e-9)


def test_the_graph_is_marked_with_a_colour_for_each_kind(topics):
    markers = {marker.ns: marker for marker in topics["/graph"][0][1].markers}
    assert list(markers) == ["keyframes", "nScan", "pairwise", "loop"]
    places = {name: [(p.x, p.y) for p in marker.points] for name, marker in markers.items()}
    at = [tuple(pose[:2]) for pose in POSES]
    assert places == {
        "keyframes": [at[0], at[2], at[4]],
        # From the fixed scan 2 to the others, two points a line.
        "nScan": [at[2], at[0], at[2], at[4]],
        "pairwise": [at[0], at[2]],
        "loop": [at[0], at[4]],
    }
    assert len({(m.color.r, m.color.g, m.color.b) for m in markers.values()}) == 4
    assert {(m.header.frame_id, m.color.a, m.action) for m in markers.values()} == {("map", 1, 0)}
    assert all(m.scale.x > 0 for m in markers.values())


def test_scans_that_are_left_out_are_not_written_but_the_path_is_whole(run):
    log, graph, _ = run
    some = np.array([1, 3])
    found = read_back(ros2_recording(log, some, some, graph, grid_of(log)))
    assert [len(found[topic]) for topic in ("/scan", "/tf")] == [2, 2]
    assert len(found["/path"][0][1].poses) == 5


def test_equal_inputs_give_equal_bytes(run):
    log, graph, data = run
    assert ros2_recording(log, NODES, NODES, graph, grid_of(log)) == data


@pytest.mark.parametrize("start", ["-12.5", "2147483647.5"])
def test_stamps_that_ros_has_no_room_for_count_from_the_first_second(start):
    stamps = tuple(repr(float(start) + 0.25 * k) for k in range(5))
    log = dataclasses.replace(small_log(), stamps=stamps, times=np.array([float(s) for s in stamps]))
    found = read_back(ros2_recording(log, NODES, NODES, small_run_graph(log), grid_of(log)))
    assert [time for time, _ in found["/scan"]] == [5 * 10**8 + 25 * 10**7 * k for k in range(5)]


@pytest.mark.parametrize("odometry", [True, False])
def test_a_recording_is_a_log_for_slam_too(run, tmp_path, odometry):
    """The scans, how the laser is mounted, and the raw odometry: not the corrected poses."""
    log = run[0] if odometry else dataclasses.replace(run[0], odometry=None)
    path = tmp_path / "out.mcap"
    path.write_bytes(ros2_recording(log, NODES, NODES, small_run_graph(log), grid_of(log)))
    back = read_log(str(path))
    np.testing.assert_array_equal(back.ranges, log.ranges)
    np.testing.assert_allclose(back.angle_min, log.angle_min, atol=1e-7)
    np.testing.assert_allclose(relative(back.mount, log.mount), 0, atol=1e-9)
    np.testing.assert_allclose(back.times, log.times)
    if log.odometry is not None:
        assert back.odometry is not None
        # Interpolated at times of 64 bits, 1e-7 s apart at the epoch's.
        np.testing.assert_allclose(relative(back.odometry, log.odometry), 0, atol=1e-5)
    else:
        assert back.odometry is None


def test_a_scan_has_its_own_beams():
    log = dataclasses.replace(small_log(), beams=np.array([181, 90, 181, 181, 2]))
    message = scan_message(MessageFactory(), log, 1, 0)
    assert len(message.ranges) == 90
    assert message.angle_max == pytest.approx(log.angle_min[1] + 89 * log.angle_increment[1])


@pytest.mark.parametrize(
    ("names", "links"),
    [
        (
            FrameNames("front", "chassis", "wheels"),
            {("map", "wheels"), ("wheels", "chassis"), ("chassis", "front")},
        ),
        # A laser in the robot's own frame has no transform.
        (FrameNames("chassis", "chassis", "odom"), {("map", "odom"), ("odom", "chassis")}),
    ],
)
def test_frames_keep_the_names_that_the_log_has(names, links):
    log = dataclasses.replace(small_log(), frames=names)
    found = read_back(ros2_recording(log, NODES, NODES, small_run_graph(log), grid_of(log)))
    placed = {
        (link.header.frame_id, link.child_frame_id)
        for topic in ("/tf", "/tf_static")
        for _time, message in found.get(topic, [])
        for link in message.transforms
    }
    assert placed == links
    assert {message.header.frame_id for _time, message in found["/scan"]} == {names.laser}
    assert {message.header.frame_id for topic in ("/map", "/path") for _time, message in found[topic]} == {
        "map"
    }
