"""Chains of transforms from one frame to another: how they are found, and the pose that they give."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from nscan_cli.logs.recordings.poses_3d import TimedPoses, inverse_transform
from nscan_cli.poses import Array

FramePair = tuple[str, str]
"""Parent frame and child frame."""
AT_ANY_TIME = np.zeros(1, dtype=np.int64)
"""The only time of a fixed transform."""


@dataclass(frozen=True)
class ChainLink:
    """One transform of a chain, over time."""

    name: str
    timed: TimedPoses
    """A fixed transform has one time only."""

    @property
    def moves(self) -> bool:
        """Whether the transform changes over time."""
        return len(self.timed.times) > 1


def shortest_chain(pairs: Iterable[FramePair], start: str, end: str) -> list[str] | None:
    """The frames from `start` to `end` along the fewest pairs, in either direction; None where none leads."""
    neighbours: dict[str, list[str]] = {}
    for parent, child in pairs:
        neighbours.setdefault(parent, []).append(child)
        neighbours.setdefault(child, []).append(parent)
    chains = {start: [start]}
    queue = [start]
    for frame in queue:
        for other in neighbours.get(frame, []):
            if other not in chains:
                chains[other] = [*chains[frame], other]
                queue.append(other)
    return chains.get(end)


def chain_links(
    frames: Sequence[str], fixed: Mapping[FramePair, Array], moving: Mapping[FramePair, TimedPoses]
) -> list[ChainLink]:
    """The transforms between the frames of a chain, each in the direction of the chain."""
    links = []
    for ends in itertools.pairwise(frames):
        pair = ends if ends in fixed or ends in moving else ends[::-1]
        timed = TimedPoses(AT_ANY_TIME, fixed[pair][None]) if pair in fixed else moving[pair]
        if pair != ends:
            timed = timed._replace(poses=inverse_transform(timed.poses))
        links.append(ChainLink(" → ".join(pair), timed))
    return links


def composed(links: Sequence[ChainLink]) -> Array:
    """The poses (n, 4, 4) of the last frame of a chain in the first, at each time when a link moves.

    Between two times of a link, its earlier pose holds. Without a moving link n is 1.
    """
    movers = [link.timed.times for link in links if link.moves] or [AT_ANY_TIME]
    times = movers[0] if len(movers) == 1 else np.unique(np.concatenate(movers))
    poses: Array = np.broadcast_to(np.eye(4), (len(times), 4, 4))
    for link in links:
        rows = np.searchsorted(link.timed.times, times, side="right") - 1
        poses = poses @ link.timed.poses[np.maximum(rows, 0)]
    return poses
