"""The poses of a topic, of each type, from each container."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.logs.load import recording_from
from nscan_cli.logs.recordings.message_types import PATH_TYPE
from nscan_cli.logs.recordings.pose_topics import poses_on_topic
from tests.logs.recordings.messages import START, S, turned
from tests.logs.recordings.ros import Message, bag1_of, bag2_of

COUNT = 5
STAMPS = [f"{(START + k * S) // S}.{(START + k * S) % S:09d}" for k in range(COUNT)]
PLACES = np.array([[0.5 * k, -0.25 * k, 0.1, *turned(0.2 * k)] for k in range(COUNT)])
POSE, COVARIANCE, MOVED = (
    f"geometry_msgs/msg/{name}" for name in ("PoseStamped", "PoseWithCovarianceStamped", "TransformStamped")
)
ODOMETRY, TRANSFORMS, IMAGE = "nav_msgs/msg/Odometry", "tf2_msgs/msg/TFMessage", "std_msgs/msg/String"


def named(names: str, values: Any) -> dict[str, float]:
    return dict(zip(names, values, strict=True))


def header(k: int, with_seq: bool, frame: str = "world", stamped: bool = True) -> dict[str, Any]:
    sec, nsec = divmod(START + k * S, S) if stamped else (0, 0)
    return ({"seq": k} if with_seq else {}) | {"stamp": {"sec": sec, "nanosec": nsec}, "frame_id": frame}


def fields(kind: str, k: int, with_seq: bool, stamped: bool = True) -> dict[str, Any]:
    """The message of a type at second k."""
    head = header(k, with_seq, stamped=stamped)
    place, turn = PLACES[k, :3], PLACES[k, 3:]
    pose = {"position": named("xyz", place), "orientation": named("xyzw", turn)}
    moved = {"translation": named("xyz", place), "rotation": named("xyzw", turn)}
    still = {"linear": named("xyz", (0.0,) * 3), "angular": named("xyz", (0.0,) * 3)}
    if kind == POSE:
        return {"header": head, "pose": pose}
    if kind == COVARIANCE:
        return {"header": head, "pose": {"pose": pose, "covariance": np.zeros(36)}}
    if kind == MOVED:
        return {"header": head, "child_frame_id": "robot", "transform": moved}
    if kind == ODOMETRY:
        spread = np.zeros(36)
        return {"header": head, "child_frame_id": "robot", "pose": {"pose": pose, "covariance": spread},
                "twist": {"twist": still, "covariance": spread}}  # fmt: skip
    if kind == PATH_TYPE:
        return {"header": head, "poses": [fields(POSE, at, with_seq) for at in range(k + 1)]}
    if kind == TRANSFORMS:
        fixed = {
            "translation": named("xyz", (1.0, 0.0, 0.0)),
            "rotation": named("xyzw", (0.0, 0.0, 0.0, 1.0)),
        }
        return {"transforms": [fields(MOVED, k, with_seq),
                               {"header": header(k, with_seq, "robot"), "child_frame_id": "laser",
                                "transform": fixed}]}  # fmt: skip
    return {"data": "nothing"}


def messages(kinds: dict[str, str], with_seq: bool, **how: bool) -> Iterator[Message]:
    for topic, kind in kinds.items():
        for k in range(COUNT):
            yield topic, kind, START + k * S, fields(kind, k, with_seq, **how)


def bag1(kinds: dict[str, str], folder: Path, **how: bool) -> bytes:
    return bag1_of(messages(kinds, True, **how), folder)


def bag2(kinds: dict[str, str], folder: Path, plugin: str = "SQLITE3", **how: bool) -> bytes:
    path = bag2_of(messages(kinds, False, **how), folder / f"made_{plugin}", plugin)
    (file,) = (path for path in path.iterdir() if path.suffix in (".db3", ".mcap"))
    return file.read_bytes()


def mcap(kinds: dict[str, str], folder: Path, **how: bool) -> bytes:
    return bag2(kinds, folder, "MCAP", **how)


CONTAINERS: list[Callable[..., bytes]] = [bag1, bag2, mcap]
PLACING = {"/pose": POSE, "/sure": COVARIANCE, "/vicon": MOVED, "/odom": ODOMETRY, "/path": PATH_TYPE}
ALL = PLACING | {"/tf": TRANSFORMS, "/talk": IMAGE}


def read(data: bytes, topic: str | None) -> tuple[list[str], np.ndarray, list[str]]:
    recording = recording_from(data, "a.bag", salvage=False)
    assert recording is not None
    notices: list[str] = []
    stamps, poses = poses_on_topic(recording, topic, "a.bag", notices)
    return stamps, poses, notices


@pytest.mark.parametrize("container", CONTAINERS)
def test_every_type_gives_the_same_poses(container, tmp_path: Path):
    data = container(ALL, tmp_path)
    for topic in ("/pose", "/sure", "/vicon", "/odom", "/path", "/tf", "/tf:world.robot"):
        stamps, poses, notices = read(data, topic)
        assert (stamps, notices) == (STAMPS, []), topic
        np.testing.assert_allclose(poses, PLACES, atol=1e-12)
    _stamps, poses, _ = read(data, "/tf:robot.laser")
    np.testing.assert_allclose(poses[:, :3], [[1, 0, 0]] * COUNT)


@pytest.mark.parametrize("container", CONTAINERS)
def test_of_paths_the_last_is_kept(container, tmp_path: Path):
    recording = recording_from(container({"/path": PATH_TYPE}, tmp_path), "a.bag", salvage=False)
    assert recording is not None
    assert [len(messages) for messages in recording.messages.values()] == [1]
    assert recording.topics_of((PATH_TYPE,)) == {"/path": COUNT}


def test_stamps_that_say_nothing_give_way_to_the_times_of_recording(tmp_path: Path):
    stamps, _, notices = read(bag1({"/pose": POSE}, tmp_path, stamped=False), "/pose")
    assert stamps == STAMPS
    assert notices == ["a.bag: the stamps on /pose are unusable: the times of recording are used"]


def test_a_topic_has_to_be_chosen_and_have_poses(tmp_path: Path):
    data = bag1(ALL | {"/more": TRANSFORMS}, tmp_path)
    listed = (
        "/more (TFMessage, 5 messages), /odom (Odometry, 5 messages), /path (Path, 5 messages), "
        "/pose (PoseStamped, 5 messages), /sure (PoseWithCovarianceStamped, 5 messages), "
        "/tf (TFMessage, 5 messages), /vicon (TransformStamped, 5 messages)"
    )
    for topic, said in (
        (None, f"a.bag: is a recording; say by --reference-topic which poses are the reference: {listed}"),
        ("/nope", f"a.bag: has no topic /nope; --reference-topic can be {listed}"),
        ("/talk", f"a.bag: /talk is of {IMAGE}, which has no poses; --reference-topic can be {listed}"),
        ("/tf:world.nobody", "a.bag: /tf has no transforms of world.nobody; give --reference-topic "
         "TOPIC:FRAMES, these are world.robot"),
    ):  # fmt: skip
        with pytest.raises(WrongUsageError) as caught:
            read(data, topic)
        assert str(caught.value) == said
    with pytest.raises(InputDataError, match=r"has no topic with poses, only /talk \(std_msgs/msg/String\)"):
        read(bag1({"/talk": IMAGE}, tmp_path), "/talk")


def test_what_is_no_recording():
    assert recording_from(io.BytesIO(b"1 2 3").getvalue(), "a.tum", salvage=False) is None
