"""What a result and its reference show of each other that no error says: clocks, units, frames, and the like.

Nothing of it changes an error. Each is said with its figure, and only where it leaves no doubt: what is said
then makes the positions fit several times better, and so well that little else can be wrong.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from nscan_cli.evaluation.alignment import alignment
from nscan_cli.evaluation.clock_lag import DRIVEN, SMALLEST, WELL, Clocks
from nscan_cli.evaluation.similarity import Fit, Lever, fit, heading_difference, lever
from nscan_cli.evaluation.trajectory_errors import TrajectoryErrors
from nscan_cli.files.counting import counted
from nscan_cli.graph.io.tum import Trajectory
from nscan_cli.poses import Array, compose

BETTER = 3.0
"""How many times nearer positions have to come to each other."""
UNITS = {1000.0: "millimetres", 100.0: "centimetres", 1 / 0.3048: "feet", 1 / 0.0254: "inches"}
UNIT_TOLERANCE, SMALLEST_FACTOR = 0.03, 0.03
SURE = 5.0
"""Standard deviations by which something has to differ from nothing."""
SMALLEST_TURN, SMALLEST_LEVER = math.radians(3.0), 0.05
OPPOSITE = math.radians(170.0)
"""rad; of frames that are turned by more, nobody asks to which side."""
CLEARLY, NEARLY, EXACT = 2.0, 1.5, 1e-5
"""How many times nearer a lever arm has to bring positions; what is nearly as near; what is rounding."""
OTHER_POINT = "the reference is of another point of the robot"
FLAT, UPRIGHT = 0.2, math.radians(5.0)
"""m and rad that motion may leave the plane by."""
JUMPS = 2.0
"""How many times longer a path is in order of time than in that of the file, if it is two."""
TWICE, FAR = 0.05, 0.05
"""Share of the stamps that are there twice, and m that their poses are apart, of two runs in one file."""


def remarks(result: Trajectory, reference: Trajectory, errors: TrajectoryErrors) -> Iterator[str]:
    """Sentences on a result and a reference that have been compared; none where all is as it should be."""
    both = (("result", result), ("reference", reference))
    mixed = [(name, said) for name, trajectory in both if (said := _two_runs(trajectory))]
    for name, said in mixed:
        yield f"the {name} has two runs under the same stamps: {said}"
    for name, trajectory in both:
        yield from _out_of_plane(trajectory, name)
    # What fits best says nothing where two runs are mixed.
    if not mixed:
        yield from _misfits(result, reference, errors)


def _two_runs(trajectory: Trajectory) -> str:
    """How a file shows that it is of two runs; empty where it does not."""
    places, times = trajectory.poses[:, :2], trajectory.times
    steps = np.hypot(*np.diff(places, axis=0).T)
    if trajectory.rows is not None:
        written = np.argsort(trajectory.rows)
        on = np.diff(times[written]) >= 0
        backward = int(np.sum(~on))
        path, there = float(np.hypot(*np.diff(places[written], axis=0)[on].T).sum()), float(steps.sum())
        if backward and there > JUMPS * path + FAR:
            return (
                f"time goes back {counted(backward, 'time')} in it, and in order of time its poses jump to "
                f"and fro (a path of {there:.1f} m in place of {path:.1f} m)"
            )
    same = np.diff(times) == 0
    firsts = places[np.append(True, ~same)]
    typical = float(np.median(np.hypot(*np.diff(firsts, axis=0).T))) if len(firsts) > 1 else 0.0
    apart = steps[same & (steps > max(FAR, BETTER * typical))]
    if len(apart) >= max(3, TWICE * len(times)):
        return f"{counted(len(apart), 'stamp')} twice, with poses up to {apart.max():.2f} m apart"
    return ""


def _out_of_plane(trajectory: Trajectory, name: str) -> Iterator[str]:
    if trajectory.spatial is None or len(trajectory) < 2:
        return
    heights, up = trajectory.spatial[:, 0], trajectory.spatial[:, 1:]
    upright = np.median(up, axis=0)
    upright /= max(float(np.linalg.norm(upright)), 1e-12)
    low, high = np.percentile(heights, [1, 99])
    tilts = np.arccos(np.clip(up @ upright, -1, 1))
    tilt, lean = float(np.percentile(tilts, 95)), float(np.arccos(np.clip(upright[2], -1, 1)))
    moves = [f"z by {high - low:.2f} m"] if high - low > FLAT else []
    moves += [f"roll and pitch by up to {math.degrees(tilts.max()):.1f}°"] if tilt > UPRIGHT else []
    if moves:
        yield (
            f"the {name} moves out of the plane, {' and '.join(moves)}: x, y and heading alone are compared"
        )
    if lean > UPRIGHT and tilt <= UPRIGHT:
        yield (
            f"the {name} is tilted by {math.degrees(lean):.1f}° throughout: its frame is not that of a robot "
            "on the floor, and its headings are those of another axis"
        )


def _misfits(result: Trajectory, reference: Trajectory, errors: TrajectoryErrors) -> Iterator[str]:
    poses, truth = result.poses[errors.rows], reference.poses[errors.partners]
    now = fit(poses, truth)
    # Either can be in a larger unit.
    if errors.alignment.by == "headings" or max(now.spread, fit(truth, poses).spread) < DRIVEN:
        found = _lever(poses, truth)
        if found is not None:
            yield f"{OTHER_POINT}: {_seen(found.point)} that of the result"
        return
    if now.apart_mirrored * BETTER < now.apart_scaled and now.apart_mirrored < WELL * now.spread:
        yield (
            "the result is the mirror image of the reference: mirrored, it would be "
            f"{now.apart_mirrored:.3g} m (RMS) off in place of {now.apart_scaled:.3g} m"
        )
        return
    clocks = Clocks.of(result.times[errors.rows], poses, reference)
    lag, found, either = _lag_and_lever(clocks, _lever(poses, truth), now)
    if lag:
        poses, truth = replace(clocks, times=result.times[errors.rows], poses=poses).at(lag)
    if found is not None and not either:
        poses = compose(poses, [*found.point, 0.0])
    left = fit(poses, truth)
    if lag:
        clock = f"the clock of the reference is {'ahead of' if lag > 0 else 'behind'} that of the result"
        alone = f"stamps off by {abs(lag):.2f} s fit best"
        if either and found is not None:
            yield f"{alone} ({clock}), or else {OTHER_POINT}, {_seen(found.point)} that of the result"
        else:
            yield f"{alone}: {clock}"
    factor = left.factor
    if abs(math.log(max(factor, 1e-12))) > SMALLEST_FACTOR and _is_better(left.apart_scaled, left.apart, now):
        yield f"factor {_factor(factor)}"
        truth = truth / [factor, factor, 1.0]
        left = fit(poses, truth)
    if left.apart < 2 * WELL * left.spread:
        turn, spread = heading_difference(poses, truth)
        if abs(turn) > max(SMALLEST_TURN, SURE * spread, SURE * left.apart / left.spread):
            side = f", those of the reference to the {'left' if turn > 0 else 'right'}"
            yield (
                f"the headings differ by {math.degrees(abs(turn)):.1f}° ± {math.degrees(spread):.1f}° "
                f"throughout: frames turned{side if abs(turn) < OPPOSITE else ''}"
            )
    if found is not None and not either:
        yield f"{OTHER_POINT}: {_seen(found.point)} that of the result"


def _lag_and_lever(clocks: Clocks, found: Lever | None, now: Fit) -> tuple[float, Lever | None, bool]:
    """The lag (s; 0: none) and the lever arm that leave no doubt, and whether it is either of them.

    Going on straight, a robot with another clock looks like one seen at another point: what both explain
    together is said only where one alone does not do nearly as well.
    """
    alone = clocks.best(lambda poses, truth: fit(poses, truth).apart_scaled)
    both = clocks.best(lambda poses, truth: getattr(lever(poses, truth), "apart", math.inf))
    least = min(
        [now.apart_scaled, *(one[1] for one in (alone, both) if one)] + ([found.apart] if found else [])
    )
    alone, both = (one if one and abs(one[0]) >= SMALLEST else None for one in (alone, both))
    by_lag = alone if alone and _is_better(alone[1], now.apart_scaled, now) else None
    # What is left then may be but rounding.
    enough = NEARLY * least + EXACT * now.spread
    if by_lag and by_lag[1] <= enough:
        either = found is not None and found.apart <= enough
        return by_lag[0], found if either else None, either
    if found is not None and found.apart <= enough:
        return 0.0, found, False
    if both and _is_better(both[1], now.apart_scaled, now):
        together = _lever(*clocks.at(both[0]))
        if together is not None:
            return both[0], together, False
    return (by_lag[0], None, False) if by_lag else (0.0, found, False)


def _lever(poses: Array, truth: Array) -> Lever | None:
    """The lever arm, where it leaves no doubt."""
    found = lever(poses, truth)
    if found is None or np.hypot(*found.point) < max(SMALLEST_LEVER, SURE * found.sigma):
        return None
    if alignment(poses, truth).by == "positions":
        return found if found.apart * CLEARLY < fit(poses, truth).apart_scaled else None
    motion = alignment(poses, truth).motion
    apart = float(np.sqrt(((compose(motion, poses) - truth)[:, :2] ** 2).sum() / len(poses)))
    return found if found.apart * CLEARLY < apart else None


def _is_better(apart: float, before: float, now: Fit) -> bool:
    return apart * BETTER < before and apart < WELL * now.spread


def _factor(factor: float) -> str:
    """What a factor from the result to the reference says."""
    larger, which = (factor, "reference") if factor > 1 else (1 / factor, "result")
    for size, unit in UNITS.items():
        if abs(larger / size - 1) < UNIT_TOLERANCE:
            return f"{size:.4g}: {unit}, the {which} seems to be in them"
    return f"{larger:.3f}: the {which} is larger by it"


def _seen(point: Array) -> str:
    """A point (2,) as a driver says where it is."""
    x, y = point.tolist()
    parts = [
        f"{abs(value):.2f} m {ahead if value > 0 else behind}"
        for value, ahead, behind in ((x, "ahead of", "behind"), (y, "left of", "right of"))
        if abs(value) >= 0.005
    ]
    return " and ".join(parts)
