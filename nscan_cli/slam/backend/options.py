"""Options of steps 5 and 6 of the loop: when the graph is optimised, until when, and how it is refined."""

from __future__ import annotations

from dataclasses import dataclass, field

from nscan_cli.graph.optimise.graph_solver import StopOptions


@dataclass(frozen=True)
class ScheduleOptions:
    """When the growing graph is optimised, and how much of it."""

    min_motion: float = 0.1
    """Least sum of the motions of scans in matches since the last optimisation, m. A larger one optimises
    less often."""
    min_new_share: float = 0.01
    """Least share of keyframes that are new since the last optimisation. A larger share optimises less
    often."""
    max_keyframes: int = 500
    """Most keyframes that are optimised at a time: those nearest to the new ones. A larger number is slower
    and more exact."""
    whole_new_share: float = 0.1
    """All keyframes are optimised when this share is new since they last were. A larger share is faster and
    less exact."""


@dataclass(frozen=True)
class OptimisationOptions:
    """How exactly the graph is optimised."""

    growing: StopOptions = field(default_factory=lambda: StopOptions(10, 1e-3))
    after_large_loop: StopOptions = field(default_factory=lambda: StopOptions(100, 1e-4))
    final: StopOptions = field(default_factory=StopOptions)
    metres_per_radian: float = 0.3
    """Length of path that counts as much as a turn by 1 rad where scans between keyframes share what the
    graph corrects, m. A larger one puts more of the correction into turns."""


@dataclass(frozen=True)
class RefinementOptions:
    """The matches that are made again from the final poses."""

    max_sweeps: int = 2
    """Most sweeps over all keyframes. A larger number is slower."""
    min_motion: float = 0.02
    """A match is made again if a scan has moved by more since, m and rad. A larger one makes fewer again."""
