"""The transforms of a recording (tf): those of frames that are fixed to each other, and those that move."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from nscan_cli.logs.recordings.container import Recording
from nscan_cli.logs.recordings.decoded_messages import StampedTransform
from nscan_cli.logs.recordings.decoding import decoded
from nscan_cli.logs.recordings.message_stamps import valid_stamps
from nscan_cli.logs.recordings.message_types import REFERENCE_TYPES, TRANSFORM_TYPES
from nscan_cli.logs.recordings.moving_mount import MountingOptions
from nscan_cli.logs.recordings.poses_3d import TimedPoses, as_matrix
from nscan_cli.logs.recordings.tf_chains import FramePair
from nscan_cli.logs.skips import Skips
from nscan_cli.poses import Array

STATIC = "tf_static"
LoggedTransform = tuple[StampedTransform, int]
"""A transform, and the time (ns) when its message was recorded."""


class TransformTree:
    """The transforms of a recording. Topics called tf_static are read at once, the others when needed."""

    def __init__(self, recording: Recording, skips: Skips) -> None:
        self.recording, self.skips = recording, skips
        self.fixed: dict[FramePair, Array] = {}
        """Pose (4, 4) of the child in the parent, of pairs of frames that are fixed to each other."""
        self._dynamic: list[LoggedTransform] | None = None
        self._add_fixed(transform for transform, _ in self._read(static=True))

    def dynamic(self) -> list[LoggedTransform]:
        """The transforms of all topics that are not called tf_static.

        Pairs of frames whose transform never changes are added to `fixed`: ROS 1 repeats those on /tf.
        """
        if self._dynamic is None:
            self._dynamic = list(self._read(static=False))
            known = set(self.fixed)
            constant = constant_transforms(transform for transform, _ in self._dynamic)
            self._add_fixed(one for one in constant if (one.parent, one.child) not in known)
        return self._dynamic

    def moving(self) -> dict[FramePair, TimedPoses]:
        """The transforms that move, in order of time; pairs of frames without a valid pose are left out."""
        found: dict[FramePair, list[LoggedTransform]] = {}
        for logged in self.dynamic():
            pair = (logged[0].parent, logged[0].child)
            if pair not in self.fixed:
                found.setdefault(pair, []).append(logged)
        moving = {
            pair: TimedPoses.of([one.pose for one, _ in rows], transform_times(rows))
            for pair, rows in found.items()
        }
        return {pair: timed for pair, timed in moving.items() if len(timed.times)}

    def _add_fixed(self, transforms: Iterable[StampedTransform]) -> None:
        """Add the valid ones; of several of the same frames the last one holds."""
        for one in transforms:
            matrix = as_matrix(one.pose)
            if matrix is not None:
                self.fixed[one.parent, one.child] = matrix

    def _read(self, static: bool) -> Iterator[LoggedTransform]:
        for topic in self.recording.topics_of(TRANSFORM_TYPES):
            if topic.rpartition("/")[2].startswith(STATIC) == static:
                yield from decoded_transforms(self.recording, topic, self.skips)


def decoded_transforms(recording: Recording, topic: str, skips: Skips) -> Iterator[LoggedTransform]:
    """All transforms on a topic of odometry, tf or poses; messages that cannot be decoded are skipped."""
    messages = recording.messages.get(topic, [])
    for _number, log_time, transforms in decoded(messages, topic, REFERENCE_TYPES, skips):
        for transform in transforms:
            yield transform, log_time


def transform_times(rows: Sequence[LoggedTransform]) -> list[int | None]:
    """The stamps (ns), None where one was never set; where none ever was, the times of recording."""
    stamps = valid_stamps([transform.stamp for transform, _ in rows])
    if any(stamp is not None for stamp in stamps):
        return stamps
    return [log_time for _, log_time in rows]


def constant_transforms(transforms: Iterable[StampedTransform]) -> list[StampedTransform]:
    """The first transform of each pair of frames that are fixed to each other."""
    first: dict[FramePair, StampedTransform] = {}
    moving = set()
    for transform in transforms:
        pair = (transform.parent, transform.child)
        known = first.setdefault(pair, transform)
        if known is not transform and pair not in moving:
            before, now = known.pose, transform.pose
            parts = (*before.translation, *before.rotation), (*now.translation, *now.rotation)
            if not all(abs(a - b) <= MountingOptions.fixed_tolerance for a, b in zip(*parts, strict=True)):
                moving.add(pair)
    return [transform for pair, transform in first.items() if pair not in moving]
