"""Input of a search: the points around a keyframe, and the likelihood field of an earlier visit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nscan_cli.matching.correlative_search import LikelihoodField, SearchOptions, likelihood_field
from nscan_cli.poses import Array, Indices, relative, transform
from nscan_cli.slam.keyframes.keyframe import Keyframe
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.loop_closure.options import LoopClosureOptions


def search_submaps(
    route: Route, centre: int, earlier: Indices, window: SearchOptions, closing: LoopClosureOptions
) -> tuple[Array, LikelihoodField] | None:
    """The points (m, 2) around keyframe `centre`, in its frame, and the likelihood field of the `earlier`
    ones (m,).

    None if one of them has no points.
    """
    keyframes, paths, poses = route.keyframes, route.paths, route.poses
    beside = np.flatnonzero(np.abs(paths - paths[centre]) <= closing.scan_path)
    scan = _cloud(keyframes, beside, relative(poses[beside], poses[centre]))
    cloud = _cloud(keyframes, earlier, poses[earlier])
    if not len(scan) or not len(cloud):
        return None
    return scan, likelihood_field(cloud, window)


def _cloud(keyframes: Sequence[Keyframe], chosen: Indices, poses: Array) -> Array:
    """The points (m, 2) of the chosen keyframes (n,), at poses (n, 3)."""
    points = [keyframes[k].points for k in chosen.tolist()]
    cloud = np.concatenate([np.empty((0, 2)), *points])
    counts = np.array([len(each) for each in points], dtype=np.int64)
    return transform(np.repeat(poses, counts, axis=0), cloud)
