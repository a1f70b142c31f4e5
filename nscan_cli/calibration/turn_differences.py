"""How far turns by scans are off those by odometry, if its stamps are moved."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.calibration.measured_steps import KnownSteps, MeasuredSteps
from nscan_cli.poses import Array, Mask


class Turns(NamedTuple):
    """n turns of the robot by its scans."""

    begins: Array
    """(n,) time when each begins, s."""
    ends: Array
    """(n,) time when it ends, s."""
    turned: Array
    """(n,) rad."""

    @classmethod
    def of_steps(cls, steps: MeasuredSteps, times: Array) -> Turns:
        """Those of measured steps, from scans that tell where the robot is at `times` (S,), s."""
        return cls(times[steps.first], times[steps.last], steps.laser[:, 2])

    @classmethod
    def of_known(cls, known: KnownSteps, times: Array) -> Turns:
        """Those of the known steps that are not in doubt, in order of their rows."""
        steps = sorted((*pair, float(step[0][2])) for pair, step in known.items() if step is not None)
        first, last, turned = np.array(steps).reshape(-1, 3).T
        return cls(times[first.astype(np.int64)], times[last.astype(np.int64)], turned)

    def of_at_least(self, turn: float) -> Turns:
        """Those of at least a `turn`, rad."""
        is_turn = np.abs(self.turned) >= turn
        return Turns(self.begins[is_turn], self.ends[is_turn], self.turned[is_turn])

    def some(self, most: int) -> Turns:
        """At most so many, spread evenly."""
        every = max(-(-len(self.turned) // most), 1)
        return Turns(self.begins[::every], self.ends[::every], self.turned[::every])


def turn_differences(
    odometry: tuple[Array, Array], steps: tuple[Array, Array], turned: Array, offsets: Array
) -> Array:
    """(O, n) differences of turns (n,) and those by odometry, rad, for each of the offsets (O,), s, that are
    added to its stamps.

    `odometry` are its stamps (P,), s, and unwrapped headings (P,), `steps` the times at which the turns begin
    (n,) and end (n,).
    """
    (at, headings), (begins, ends) = odometry, steps
    told = np.interp(ends - offsets[:, None], at, headings)
    told -= np.interp(begins - offsets[:, None], at, headings)
    return np.abs(told - turned)


def are_told(at: Array, steps: tuple[Array, Array], offsets: Array, longest: float) -> Mask:
    """(O, n) whether odometry with stamps (P,), s, tells turns that begin and end at times (n,), at each of
    the offsets (O,), s: there is no gap in it that is longer than so many seconds."""
    gaps = np.append(0, np.cumsum(np.diff(at) > longest))
    begins, ends = (times - offsets[:, None] for times in steps)
    before = np.maximum(np.searchsorted(at, begins, "right") - 1, 0)
    behind = np.minimum(np.searchsorted(at, ends), len(at) - 1)
    told: Mask = gaps[before] == gaps[behind]
    return told
