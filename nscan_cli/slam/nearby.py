"""Step 3 of the loop (paper, V): the joint match of a keyframe with those near it, as one relation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nscan_cli.graph.model import NScan, Pairwise
from nscan_cli.matching.joint import JointMatch, JointOptions, match_jointly
from nscan_cli.matching.joint_energy import Priors, Scans, all_pairs, lay_out, no_priors
from nscan_cli.matching.overlap import held_together, overlaps
from nscan_cli.poses import Array, relative
from nscan_cli.slam.keyframes import Keyframe
from nscan_cli.slam.options import NScanOptions

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Nearby:
    """What a joint match gave."""

    members: Indices
    """Places of the keyframes that were tried."""
    relation: NScan | None
    """None when the match was refused."""
    reason: str
    """Why it was refused, or which keyframes were left out."""
    score: float
    """The least overlap that holds the scans together."""
    closes_loop: bool
    """Whether keyframes from further back along the path took part."""
    moved: float
    """How far (m) the match moved a scan, seen from the newest."""


def choose_nearby(poses: Array, paths: Array, newest: int, options: NScanOptions) -> tuple[Indices, bool]:
    """The keyframes for a joint match with `newest`, and whether some were seen before.

    Poses (K, 3) are global ones, paths (K,) lengths of path. Of the keyframes within the radius, those
    nearest are taken; half of the places are kept for what was seen before, further back on the path.
    """
    distances = np.hypot(*(poses[: newest + 1, :2] - poses[newest, :2]).T)
    near = np.flatnonzero(distances <= options.radius)
    near = near[np.argsort(distances[near], kind="stable")]
    before = paths[newest] - paths[near] > options.recent
    old, recent = near[before], near[~before]
    recent = recent[: options.max_scans - min(len(old), options.max_scans // 2)]
    old = old[: options.max_scans - len(recent)]
    return np.sort(np.concatenate([old, recent])), len(old) > 0


def match_nearby(
    keyframes: Sequence[Keyframe],
    poses: Array,
    pairwise: Sequence[Pairwise],
    newest: int,
    options: NScanOptions,
) -> Nearby | None:
    """Match a keyframe jointly with those near it, with the pairwise relations among them as priors.

    `poses` (K, 3) are the global poses so far, `pairwise[k]` leads from keyframe k to k + 1. Scans that
    do not hang together with the newest by overlaps are left out, and the others matched again. None
    when there are too few keyframes near.
    """
    paths = np.array([keyframe.tracked.path for keyframe in keyframes[: newest + 1]])
    tried, closes_loop = choose_nearby(poses, paths, newest, options)
    if len(tried) <= 2:
        return None
    # Mostly the poses are right to centimetres already, and the last stage is all it takes.
    for widenings in (options.widenings[-1:], options.widenings):
        nearby = _match_held(keyframes, poses, pairwise, tried, closes_loop, widenings, options)
        if nearby.relation is not None and not nearby.reason and nearby.moved < options.settled:
            break
    return nearby


def _match_held(
    keyframes: Sequence[Keyframe],
    poses: Array,
    pairwise: Sequence[Pairwise],
    tried: Indices,
    closes_loop: bool,
    widenings: tuple[float, ...],
    options: NScanOptions,
) -> Nearby:
    """Match jointly, leave out what does not hang together, and match again, until all does."""
    members, start = tried, poses[tried]
    while len(members) > 2:
        scans = lay_out([keyframes[k].ndt for k in members], [keyframes[k].points for k in members])
        match = _match(scans, members, pairwise, start, widenings, options)
        shares = overlaps(scans, match.poses).pairs
        last = len(members) - 1
        held = held_together(shares, options.overlap, last)
        if held.all():
            return _judge(keyframes, tried, members, match, shares, poses, closes_loop, options)
        members, start = members[held], match.poses[held]
    return Nearby(tried, None, "overlaps none of the others", 0.0, closes_loop, 0.0)


def _match(
    scans: Scans,
    members: Indices,
    pairwise: Sequence[Pairwise],
    start: Array,
    widenings: tuple[float, ...],
    options: NScanOptions,
) -> JointMatch:
    """The joint match of some keyframes from global poses (n, 3)."""
    consecutive = np.flatnonzero(np.diff(members) == 1)
    priors = no_priors()
    if len(consecutive):
        known = [pairwise[members[k]] for k in consecutive]
        priors = Priors(
            np.stack([consecutive, consecutive + 1], axis=1),
            np.array([relation.measurement for relation in known]),
            np.array([relation.information for relation in known]),
        )
    joint = JointOptions(widenings, options.max_iterations, options.tolerance)
    return match_jointly(scans, all_pairs(len(members)), priors, start, options.scale, joint)


def _judge(
    keyframes: Sequence[Keyframe],
    tried: Indices,
    members: Indices,
    match: JointMatch,
    shares: Array,
    poses: Array,
    closes_loop: bool,
    options: NScanOptions,
) -> Nearby:
    """Make a relation of a match, or say why not."""
    last = len(members) - 1
    links = np.maximum(shares, shares.T)
    score = float(links[links >= options.overlap].min())
    before = relative(poses[members], poses[members[last]])
    after = relative(match.poses, match.poses[last])
    moved = float(np.hypot(*(after - before)[:, :2].T).max())
    if not match.converged:
        return Nearby(tried, None, "did not converge", score, closes_loop, moved)
    missing = np.setdiff1d(tried, members)
    reason = f"{len(missing)} scans left out" if len(missing) else ""
    eigenvalues, vectors = np.linalg.eigh(match.hessian)
    relation = NScan(
        nodes=tuple(int(keyframes[k].row) for k in members),
        poses=match.poses,
        # What is left of negative curvature at the optimum is rounding, or a cell's border.
        hessian=(vectors * np.maximum(eigenvalues, 0.0)) @ vectors.T,
        fixed=last,
        origin="loop" if closes_loop else "nscan",
        score=score,
    )
    return Nearby(tried, relation, reason, score, closes_loop, moved)
