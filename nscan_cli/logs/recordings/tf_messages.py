"""The transforms of a recording: fixed ones, and those that move."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from nscan_cli.logs.recordings.container import TRANSFORMS, Recording
from nscan_cli.logs.recordings.decoded_messages import FramePose
from nscan_cli.logs.recordings.decoding import UNDECODABLE, placed_decoder
from nscan_cli.logs.recordings.message_stamps import stamps_set
from nscan_cli.logs.recordings.tf_chains import Frames, Pair, Timed, over_time, unmoved
from nscan_cli.logs.skips import Skips

STATIC = "tf_static"
BASES = ("base_footprint", "base_link")
"""Frames of a robot (ROS REP 105), the one to be preferred first."""
ODOM = ("odom", "odom_combined")
"""Frames that odometry places a robot in."""
WORLD = (*ODOM, "map", "world", "earth")
"""Frames that are no robot's (REP 105): what moves in one of them is the robot itself."""
Logged = tuple[FramePose, int]
"""What a message places, and when it was recorded (ns)."""


class Transforms:
    """The transforms of a recording: those that are fixed by name at once, the others when asked for."""

    def __init__(self, recording: Recording, skips: Skips, file: str) -> None:
        self.recording, self.skips, self.file = recording, skips, file
        self.frames = Frames()
        self._others: list[Logged] | None = None
        for placed, _ in self._read(static=True):
            self.frames.add(placed)

    def others(self) -> list[Logged]:
        """The transforms of all other topics, with the times (ns) when they were recorded.

        Those that never move become fixed ones: ROS 1 sends these again and again.
        """
        if self._others is None:
            self._others = list(self._read(static=False))
            for placed in unmoved(placed for placed, _ in self._others):
                if (placed.parent, placed.child) not in self.frames.fixed:
                    self.frames.add(placed)
        return self._others

    def moving(self) -> dict[Pair, Timed]:
        """The transforms that move, in order of time; without those that are no rigid motions."""
        found: dict[Pair, list[Logged]] = {}
        for one in self.others():
            pair = (one[0].parent, one[0].child)
            if pair not in self.frames.fixed:
                found.setdefault(pair, []).append(one)
        moving = {
            pair: over_time([one.pose for one, _ in rows], stamps_of(rows)) for pair, rows in found.items()
        }
        return {pair: timed for pair, timed in moving.items() if len(timed.times)}

    def _read(self, static: bool) -> Iterator[Logged]:
        for topic in self.recording.topics(TRANSFORMS):
            if topic.rpartition("/")[2].startswith(STATIC) == static:
                yield from decoded(self.recording, topic, self.skips, self.file)


def decoded(recording: Recording, topic: str, skips: Skips, file: str) -> Iterator[Logged]:
    """What the messages of a topic place, with the times (ns) when they were recorded."""
    messages = recording.messages.get(topic, [])
    decoders = {
        channel: placed_decoder(channel, file) for channel in dict.fromkeys(m.channel for m in messages)
    }
    for number, message in enumerate(messages, 1):
        try:
            found = decoders[message.channel](message.data)
        except UNDECODABLE:
            skips.add(f"{topic}: cannot be decoded", number)
            continue
        for placed in found:
            yield placed, message.log_time


def stamps_of(rows: Sequence[Logged]) -> list[int | None]:
    """When (ns) things were placed, by their stamps; None where one was never set.

    Where none was ever set, the times of recording are taken.
    """
    stamps = stamps_set([placed.stamp for placed, _ in rows])
    if any(stamp is not None for stamp in stamps):
        return stamps
    return [log_time for _, log_time in rows]


def base_of(name: str) -> str:
    """A frame's name without that of its robot, which some have in front."""
    return name.rpartition("/")[2]


def robot_of(name: str) -> str:
    """The robot in front of a frame's name; empty where there is none."""
    return name.rpartition("/")[0]


def is_world(name: str) -> bool:
    """Whether a frame is one in which robots move."""
    return base_of(name) in WORLD
