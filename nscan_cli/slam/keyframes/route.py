"""Step 2 of the loop: the keyframes along the path, and the chain of relations between them (paper, V)."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nscan_cli.graph.model import Pairwise
from nscan_cli.graph.relations.semidefinite import as_information
from nscan_cli.poses import Array, Indices, Mask, compose, relative
from nscan_cli.slam.keyframes.keyframe import Keyframe
from nscan_cli.slam.keyframes.options import KeyframeOptions


class Route(NamedTuple):
    """K keyframes along the path, and their poses in the graph."""

    keyframes: Sequence[Keyframe]
    """The keyframes of the route, and maybe more that are not in the graph yet."""
    rows: Indices
    """(K,) their rows in the log, which are the ids of their nodes."""
    chain: Sequence[Pairwise]
    """The relations of tracking: `chain[k]` leads from keyframe k to k + 1. More may follow, too."""
    paths: Array
    """(K,) the length of path up to each, m."""
    poses: Array
    """(K, 3) global poses."""


def distances_from(route: Route, keyframe: int) -> Array:
    """(K,) distances of the keyframes from one of them, m."""
    away: Array = np.hypot(*(route.poses[:, :2] - route.poses[keyframe, :2]).T)
    return away


def is_earlier(route: Route, keyframe: int, path: float) -> Mask:
    """(K,) whether each keyframe is of a visit before that of a keyframe: earlier by more than a path, m."""
    earlier: Mask = route.paths[keyframe] - route.paths > path
    return earlier


def route_of(keyframes: Sequence[Keyframe], chain: Sequence[Pairwise], poses: Array) -> Route:
    """The route of the first K keyframes, at poses (K, 3)."""
    own = keyframes[: len(poses)]
    rows = np.array([keyframe.row for keyframe in own], dtype=np.int64)
    return Route(keyframes, rows, chain, np.array([keyframe.tracked.path for keyframe in own]), poses)


def extended(route: Route, size: int) -> Route:
    """The route with its first `size` keyframes; the chain places the new ones."""
    known = len(route.poses)
    new, poses = route.keyframes[known:size], [route.poses[-1]]
    for relation in route.chain[known - 1 : size - 1]:
        poses.append(compose(poses[-1], relation.measurement))
    return route._replace(
        rows=np.concatenate([route.rows, [keyframe.row for keyframe in new]], dtype=np.int64),
        paths=np.concatenate([route.paths, [keyframe.tracked.path for keyframe in new]]),
        poses=np.concatenate([route.poses, np.reshape(poses[1:], (-1, 3))]),
    )


def chain_relations(keyframes: Sequence[Keyframe], options: KeyframeOptions) -> list[Pairwise]:
    """The K − 1 pairwise relations of K keyframes, each to the one before it, as they were tracked.

    The information is that of the match, scaled, and of the prior; drift that no match shows limits it.
    """
    if len(keyframes) < 2:
        return []
    before, last = [each.tracked for each in keyframes[:-1]], [each.tracked for each in keyframes[1:]]
    angles = np.array([tracked.pose[2] for tracked in before])
    rotation = np.zeros((len(before), 3, 3))
    rotation[:, 0, 0] = rotation[:, 1, 1] = np.cos(angles)
    rotation[:, 0, 1] = np.sin(angles)
    rotation[:, 1, 0] = -rotation[:, 0, 1]
    rotation[:, 2, 2] = 1.0
    hessians = as_information(np.array([tracked.hessian for tracked in last]))
    expected = np.array([each.prior_covariance for each in keyframes[1:]])
    information = options.information_scale * rotation @ hessians @ rotation.transpose(0, 2, 1)
    lengths = np.array([b.path - a.path for a, b in itertools.pairwise(each.tracked for each in keyframes)])
    drift = np.array([options.drift, options.drift, options.drift_angle]) ** 2
    covariances = np.linalg.inv(information + np.linalg.inv(expected))
    covariances[:, range(3), range(3)] += drift * (lengths[:, None] + options.drift_min_path)
    guesses = np.array([each.guess_variances for each in keyframes[1:]])
    covariances[:, range(3), range(3)] += guesses[:, [0, 0, 1]]
    return [
        Pairwise(
            nodes=(a.row, b.row),
            measurement=relative(b.tracked.pose, a.tracked.pose),
            information=known,
            origin="track",
            score=b.tracked.inliers,
        )
        for a, b, known in zip(keyframes[:-1], keyframes[1:], np.linalg.inv(covariances), strict=True)
    ]
