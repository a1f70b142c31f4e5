"""The parameters of mapping a drive again."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class VerificationOptions:
    """Over which ways maps of the same drive are compared, and where they are not."""

    ways: tuple[float, ...] = (1.0, 5.0, 20.0)
    """Lengths of the path over which relative positions are compared, m. Over longer ones small errors of
    heading count more."""
    least_move: float = 0.1
    """The way counts in pieces of at least this length, m. A smaller value counts the noise of a robot that
    stands as a way."""
    max_step: float = 0.3
    """A way is left out on which a repeated map has two scans farther apart, m: with every second scan it may
    be lost there. With a larger value more is compared."""
    max_turn: float = 0.26
    """The same for their turn, rad."""
    start: float = 0.3
    """Without odometry a robot that begins in a bare corridor seems to stand at first. Nothing counts before
    the repeated map has it this far from where it began, m."""
    max_difference: float = 0.3
    """A larger difference of two maps is a warning, m. It is below 0.2 m on sound logs."""
    bound: float | None = None
    """A larger difference is a failure, m; None: none is."""
