"""Joint matching of a keyframe with its neighbours, as one nScan relation (paper, V: step 3 of the loop)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from nscan_cli.files.text import counted
from nscan_cli.graph.model import Loop, NScan, Pairwise
from nscan_cli.matching.joint.ambiguity import with_ambiguity
from nscan_cli.matching.joint.joint_energy import JointProblem, Priors, all_pairs, no_priors
from nscan_cli.matching.joint.joint_match import match_jointly
from nscan_cli.matching.joint.options import JointOptions
from nscan_cli.matching.joint.overlap import connected_at, connectivity
from nscan_cli.matching.joint.scan_set import ScanSet, scan_set
from nscan_cli.matching.pose_kernels import largest_motion
from nscan_cli.poses import Array, Indices, Mask, compose, relative
from nscan_cli.slam.keyframes.keyframe import Keyframe, points_per_cell
from nscan_cli.slam.keyframes.route import Route
from nscan_cli.slam.local_matching.neighbours import Neighbours, choose_neighbours
from nscan_cli.slam.local_matching.options import NScanOptions


@dataclass(frozen=True)
class LocalMatch:
    """The result of matching a keyframe with its neighbours, jointly or one by one."""

    pairwise: tuple[Pairwise, ...]
    """The relations of single matches."""
    nscan: NScan | None
    """The relation of a joint match; None when too few scans match each other, or the match did not
    converge."""
    loop: Loop | None
    """The verdict on what another visit saw; None where nothing was."""
    moved: float
    """How far (m) the match moved a scan, seen from the centre."""
    whole: bool
    """Whether all scans that were tried are related."""
    alike: frozenset[int] = frozenset()
    """The keyframes that were matched jointly at last: about each of them the same neighbours give the same
    match."""

    @property
    def relations(self) -> list[Pairwise | NScan]:
        """All relations of the match."""
        return [*self.pairwise, *([] if self.nscan is None else [self.nscan])]

    def tie(self, centre: int) -> tuple[int, Array] | None:
        """A node of another visit, and the pose (3,) of node `centre` in its frame; None without a loop."""
        for pair in self.pairwise:
            if pair.origin == "loop":
                return pair.nodes[0], pair.measurement
        if self.nscan is None or self.nscan.origin != "loop" or self.loop is None:
            return None
        nodes, poses = self.nscan.nodes, self.nscan.poses
        old = self.loop.nodes[0]
        return old, relative(poses[nodes.index(centre)], poses[nodes.index(old)])


LocalMatcher = Callable[[Route, int, Neighbours, NScanOptions], LocalMatch | None]
"""Step 3, jointly or in pairs: match_neighbours tells the arguments."""


def match_neighbours(route: Route, centre: int, near: Neighbours, options: NScanOptions) -> LocalMatch | None:
    """Match a keyframe jointly with its neighbours. The relations of the chain among them are priors.

    Scans without enough overlap with the `centre`, directly or through others, are left out, and the rest are
    matched again. None if too few keyframes are near.
    """
    if len(near.members) < options.min_scans:
        return None
    for widenings in options.attempts:
        local_match, is_enough = _match_held(route, near, centre, widenings, options)
        if is_enough and local_match.moved < options.max_last_stage_motion:
            break
    return local_match


def of_this_visit(route: Route, centre: int, options: NScanOptions) -> Mask:
    """(K,) whether each keyframe belongs to the visit of keyframe `centre`, along the path."""
    this: Mask = np.abs(route.paths - route.paths[centre]) <= options.visit_path
    return this


def visit_moved(route: Route, centre: int, place: Array, options: NScanOptions) -> Array:
    """The poses (K, 3) with keyframe `centre` at a place (3,), and its visit moved with it rigidly."""
    moved, visit = route.poses.copy(), of_this_visit(route, centre, options)
    moved[visit] = compose(place, relative(moved[visit], route.poses[centre]))
    return moved


def match_at(
    route: Route, centre: int, places: Sequence[Array], options: NScanOptions
) -> list[tuple[float, Array]]:
    """Joint matches that start with the centre at several places (3,): the energy of each, and the centre's
    pose there.

    The visit of the centre is moved to each place rigidly; others stay. All matches have the same scans,
    those that are near at any of the places, so that their energies can be compared.
    """
    starts = [visit_moved(route, centre, place, options) for place in places]
    near = [choose_neighbours(start, route.paths, centre, options).members for start in starts]
    members = np.unique(np.concatenate(near))
    visit = of_this_visit(route, centre, options)[members]
    scans, old = _laid_out(route.keyframes, members), int(np.argmin(visit))
    at, held = int(np.searchsorted(members, centre)), route.poses[members[old]]
    found = []
    for start in starts:
        problem = _problem(scans, members, route, options)
        match = match_jointly(problem, start[members], _stages(options.widenings, options, False))
        found.append((match.energy, compose(held, relative(match.poses[at], match.poses[old]))))
    return found


def _match_held(
    route: Route, near: Neighbours, centre: int, widenings: tuple[float, ...], options: NScanOptions
) -> tuple[LocalMatch, bool]:
    """Match jointly, leave out scans without enough overlap, and match again, until all match.

    Also returns whether further stages cannot add scans: the match converged, and all scans took part at
    first. Scans that are left out later hardly ever come back.
    """
    keyframes, poses, (members, from_other_visit, _) = route.keyframes, route.poses, near
    kept, start, scans = np.arange(len(members)), poses[members], _laid_out(keyframes, members)
    if len(widenings) == 1:
        held = connected_at(
            scans,
            start,
            options.inlier_bound,
            options.start_overlap * options.min_overlap,
            int(members.searchsorted(centre)),
        )
        kept, start = kept[held], start[held]
    all_began = len(kept) == len(members)
    while len(kept) >= options.min_scans:
        related = members[kept]
        if len(related) < len(scans.usual):
            scans = _laid_out(keyframes, related)
        problem = _problem(scans, related, route, options)
        one_visit = not from_other_visit[kept].any()
        match = match_jointly(problem, start, _stages(widenings, options, one_visit))
        at = int(related.searchsorted(centre))
        held, score = connectivity(scans, match.poses, options.inlier_bound, options.min_overlap, at)
        if not held.all():
            kept, start = kept[held], match.poses[held]
            continue
        if not match.converged:
            loop = verdict(keyframes, members, from_other_visit, centre, False, "did not converge", score)
            return LocalMatch((), None, loop, 0.0, False, frozenset(related.tolist())), False
        closed = bool(from_other_visit[kept].any())
        # What is left of negative curvature at the optimum is rounding, or a cell's border.
        eigenvalues, vectors = np.linalg.eigh(match.hessian)
        definite = (vectors * np.maximum(eigenvalues, 0.0)) @ vectors.T
        relation = NScan(
            nodes=tuple(route.rows[related].tolist()),
            poses=match.poses,
            hessian=with_ambiguity(problem, match.poses, definite, options.ambiguity),
            fixed=at,
            origin="loop" if closed else "nscan",
            score=score,
        )
        whole = len(kept) == len(members)
        reason = "" if whole else f"{counted(len(members) - len(kept), 'scan')} left out"
        used, before = (related, from_other_visit[kept]) if closed else (members, from_other_visit)
        loop = verdict(keyframes, used, before, centre, closed, reason, score)
        moved = largest_motion(poses[related], match.poses, at)[0]
        return LocalMatch((), relation, loop, moved, whole, frozenset(related.tolist())), all_began
    reason = f"only {len(kept)} of {len(members)} scans match each other"
    loop = verdict(keyframes, members, from_other_visit, centre, False, reason, 0.0)
    return LocalMatch((), None, loop, 0.0, False), all_began


def _laid_out(keyframes: Sequence[Keyframe], members: Indices) -> ScanSet:
    chosen = [keyframes[k] for k in members.tolist()]
    return scan_set([each.ndt for each in chosen], [each.points for each in chosen], neutral=False)


def _problem(scans: ScanSet, members: Indices, route: Route, options: NScanOptions) -> JointProblem:
    """The joint energy of some keyframes, with the relations of the chain among them as priors."""
    (consecutive,) = np.nonzero(members[1:] == members[:-1] + 1)
    known = [route.chain[k] for k in members[consecutive].tolist()]
    priors = (
        no_priors()
        if not known
        else Priors(
            consecutive[:, None] + np.arange(2),
            np.array([relation.measurement for relation in known]),
            np.array([relation.information for relation in known]),
        )
    )
    scale = scale_of([route.keyframes[k] for k in members.tolist()], options)
    return JointProblem(scans, all_pairs(len(members)), priors, scale)


def _stages(widenings: tuple[float, ...], options: NScanOptions, one_visit: bool) -> JointOptions:
    return JointOptions(
        widenings,
        near=options.wide_tolerance,
        stride=options.thinning if len(widenings) == 1 else JointOptions.stride,
        max_iterations=options.max_iterations,
        tolerance=options.tolerance,
        stretched=one_visit,
        # The last step is shorter than a millimetre: its end need not be looked at.
        thorough=False,
    )


def scale_of(keyframes: Sequence[Keyframe], options: NScanOptions) -> float:
    """The factor that makes the energy of some keyframes' scans a negative log likelihood."""
    return options.scale_per_cell / points_per_cell(keyframes)


def verdict(
    keyframes: Sequence[Keyframe],
    members: Indices,
    from_other_visit: Mask,
    centre: int,
    accepted: bool,
    reason: str,
    score: float,
) -> Loop | None:
    """The verdict on the loop between the first keyframe of another visit and the centre."""
    if not from_other_visit.any():
        return None
    first = members[np.argmax(from_other_visit)]
    return Loop((keyframes[first].row, keyframes[centre].row), accepted, reason, score)
