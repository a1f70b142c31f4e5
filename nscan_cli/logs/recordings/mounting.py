"""The pose of the laser on the robot: from --mount, else from the transforms of the recording (tf)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from nscan_cli.errors import InputDataError
from nscan_cli.logs.assemble import ReaderFindings
from nscan_cli.logs.recordings.decoded_messages import ScanMessage
from nscan_cli.logs.recordings.frame_ids import BASE_FRAMES, is_world_frame, tf_prefix, without_prefix
from nscan_cli.logs.recordings.moving_mount import MountingOptions, MovingMount, moving_mount
from nscan_cli.logs.recordings.poses_3d import TimedPoses, planar_mount
from nscan_cli.logs.recordings.tf_chains import ChainLink, FramePair, chain_links, composed, shortest_chain
from nscan_cli.logs.recordings.tf_tree import TransformTree
from nscan_cli.poses import Array


class MountingError(InputDataError):
    """A laser is tilted or moves, so that no map can be made of its scans; --mount overrides it."""

    def __init__(self, file: str, problem: str, remedy: str) -> None:
        super().__init__(file, problem, remedy)
        self.problem = problem


def laser_mounting(
    scans: Sequence[ScanMessage], robot: str, tree: TransformTree, findings: ReaderFindings
) -> tuple[Array, bool, str]:
    """The laser's pose on the robot (3,), whether it is upside down, and the robot's frame if it is known.

    Without --mount, the transforms between `robot` (empty when odometry does not name it) and the laser
    give the pose, or their mean when they rock as those of a stabiliser. Raises MountingError when the
    laser is tilted, or moves otherwise.
    """
    if findings.options.mount is not None:
        findings.used["mounting"] = "--mount"
        return np.array(findings.options.mount, dtype=np.float64), False, robot
    file = tree.skips.file
    links, frames, how = _laser_chain(tree, robot, scans[0].frame)
    if frames is None:
        findings.used["mounting"] = "assumed: at the robot's centre"
        findings.warnings.append(f"{how}: the laser is taken as at the robot's centre; see --mount")
        frames = [scans[0].frame]
    else:
        robot = frames[0]
        at_robot = f"none: the scans are in the robot's frame, {robot}"
        findings.used["mounting"] = at_robot if len(frames) == 1 else how
    links += _poses_in_scans(scans)
    moving = moving_mount(links)
    if moving is None:
        mount, hanging, tilt = planar_mount(composed(links)[0])
        if tilt > MountingOptions.tilt:
            problem = f"its laser is tilted by {math.degrees(tilt):.1f}° (tf {' → '.join(frames)})"
            raise MountingError(file, problem, "give --mount X,Y,DEG to use its scans as if it were level")
    elif moving.problem():
        raise _moving_laser(moving, links, frames, file)
    else:
        mount, hanging = moving.mount, moving.hangs
        findings.used["mounting"] += f"; {_moving_links(links)}, {moving.extent()}: the mean is used"
    if hanging:
        findings.used["mounting"] += ", upside down"
    return mount, hanging, robot


def _laser_chain(
    tree: TransformTree, robot: str, laser: str
) -> tuple[list[ChainLink], list[str] | None, str]:
    """The transforms from the robot's frame to the laser's, the frames, and which these are in words.

    The frames are None when no transforms lead there; the words say so then. Raises MountingError where
    the laser nods on the frame that it hangs on, whether that is the robot's or not.
    """
    for base, moving in _base_frames(tree, robot):
        frames = shortest_chain([*tree.fixed, *moving], base, laser)
        if frames is not None:
            how = f"tf {' → '.join(frames)}"
            if robot and base != robot:
                how += f", with {base} for {robot}, which has no transforms"
            return chain_links(frames, tree.fixed, moving), frames, how
    if not robot and without_prefix(laser) in BASE_FRAMES:
        return [], [laser], ""
    moving = _moving_on_robot(tree)
    frames = _ancestors([*tree.fixed, *moving], laser)
    links = chain_links(frames, tree.fixed, moving)
    mount = moving_mount(links)
    if mount is not None and mount.nods:
        raise _moving_laser(mount, links, frames, tree.skips.file)
    scans = laser or "the unnamed frame of the scans"
    if not robot and not tree.fixed and not moving:
        return [], None, f"the recording has no transforms, so none lead to {scans}"
    return [], None, f"no transforms lead from {robot or ' or '.join(BASE_FRAMES)} to {scans}"


def _base_frames(tree: TransformTree, robot: str) -> Iterator[tuple[str, Mapping[FramePair, TimedPoses]]]:
    """Frames that can be the robot's, in order of preference, each with the moving transforms to use.

    Transforms of tf_static come first, then all that never change, then also those that move. When
    odometry names one of BASE_FRAMES, the other one is tried after it (REP 105 has both in one robot).
    """
    if robot:
        yield robot, {}
        tree.dynamic()
        yield robot, {}
        yield robot, _moving_on_robot(tree)
    if robot and without_prefix(robot) not in BASE_FRAMES:
        return
    for stage in ("tf_static", "constant", "moving"):
        if stage != "tf_static":
            tree.dynamic()
        moving = _moving_on_robot(tree) if stage == "moving" else {}
        known = {frame for pairs in (tree.fixed, moving) for pair in pairs for frame in pair}
        for base in BASE_FRAMES:
            for frame in sorted(known):
                is_other = not robot or (frame != robot and tf_prefix(frame) == tf_prefix(robot))
                if without_prefix(frame) == base and is_other:
                    yield frame, moving


def _moving_on_robot(tree: TransformTree) -> dict[FramePair, TimedPoses]:
    """The transforms that move and are not the robot's own motion in the world."""
    return {pair: timed for pair, timed in tree.moving().items() if not is_world_frame(pair[0])}


def _ancestors(pairs: Sequence[FramePair], laser: str) -> list[str]:
    """The frames from the laser's topmost parent below the world down to the laser."""
    parents = {child: parent for parent, child in pairs if not is_world_frame(parent)}
    frames = [laser]
    while frames[0] in parents and parents[frames[0]] not in frames:
        frames.insert(0, parents[frames[0]])
    return frames


def _poses_in_scans(scans: Sequence[ScanMessage]) -> list[ChainLink]:
    """The laser's poses in its frame as one more link, where the scan messages have them."""
    found = [(scan.stamp, scan.pose) for scan in scans if scan.pose is not None]
    if len({pose for _, pose in found}) == 1:
        del found[1:]
    timed = TimedPoses.of([pose for _, pose in found], [stamp for stamp, _ in found])
    return [ChainLink("the pose in its scans", timed)] if len(timed.times) else []


def _moving_laser(
    mount: MovingMount, links: Sequence[ChainLink], frames: Sequence[str], file: str
) -> MountingError:
    chain = f" (tf {' → '.join(frames)})" if len(frames) > 1 else ""
    problem = f"its laser {mount.problem()}: {_moving_links(links)}{chain}"
    return MountingError(file, problem, "give --mount X,Y,DEG to use a fixed mounting")


def _moving_links(links: Sequence[ChainLink]) -> str:
    movers = [link.name for link in links if link.moves]
    return f"{' and '.join(movers)} move{'s' if len(movers) == 1 else ''}"
