"""Odometry that goes to and fro for some seconds, as no robot drives: noise on a cable, a node that fails.

Each of its poses is far from the way between the poses before and behind, now on this side and now on that.
A robot that speeds up or turns is off for several poses on one side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nscan_cli.files.text import shortened_list
from nscan_cli.logs.mask_runs import mask_runs
from nscan_cli.logs.steady_way import are_regular, farthest_by_force, new_poses, off_steady_way
from nscan_cli.poses import Array, Mask, are_known, wrap


@dataclass(frozen=True)
class JitteryOdometryOptions:
    """When odometry goes to and fro as no robot does."""

    min_distance: float = 0.25
    """Noise moves poses farther than this off the way between those before and behind, m. It is 0.17 at most
    on real logs, in the median of a window. A larger value finds less."""
    min_turn: float = 0.2
    """Noise also turns poses by more than this against that way, rad. It is 0.12 at most on real logs. A
    larger value finds less."""
    max_acceleration: float = 5.0
    """No robot with a laser speeds up, brakes, or begins to turn faster, m/s² and rad/s². A larger value
    finds less."""
    window: int = 9
    """Number of successive poses of which noise moves two thirds so far: a single wrong value moves three. A
    larger value finds only longer stretches."""
    beside: float = 0.5
    """Beside a window of noise, others count where most poses are farther off than this share of the bounds
    `min_distance` and `min_turn`. A larger value leaves more of the noise."""
    max_correlation: float = -0.4
    """Noisy poses are off on opposite sides in turn: the correlation from pose to pose is less than this.
    That of white noise is −2/3, that of a robot that turns is positive. A larger value finds more."""
    min_of_steps: float = 0.7
    """Noisy poses are farther off than this share of the steps between them, as root mean squares: that of
    white noise is 0.87. It is 0.4 at most on real logs, in any unit of length. A larger value finds less."""
    regular: float = 2.0
    """Turns count only where times are apart as usual, within this factor. A larger value finds more, also
    where poses come in the wrong order."""
    max_share: float = 0.5
    """With a larger share of such poses it is open what is noise, and all are used. A larger value believes
    less."""


def without_jitter(
    odometry: Array, times: Array, options: JitteryOdometryOptions = JitteryOdometryOptions()
) -> tuple[Array, str]:
    """Odometry (S, 3) at times (S,), s, unknown where it goes to and fro as no robot does; and what to say.

    Unknown poses are nan and stay so. The text is empty where nothing is changed.
    """
    known = np.flatnonzero(are_known(odometry))
    rows = known[new_poses(odometry[known], times[known])]
    if len(rows) < options.window + 2:
        return odometry, ""
    poses, at = odometry[rows], times[rows]
    is_noise, places = np.zeros(len(rows), dtype=np.bool_), (0, 1, 2)
    off = off_steady_way(poses, at, places)
    # A robot that turns on the spot turns fast: poses in the wrong order then go to and fro as well.
    off[~are_regular(at, places, options.regular), 2] = 0.0
    limits = farthest_by_force(at[2:] - at[:-2], options.max_acceleration)
    steps = np.diff(poses, axis=0)[1:]
    steps[:, 2] = wrap(steps[:, 2])
    for columns, least, limit in (
        (slice(0, 2), options.min_distance, limits[:, 0]),
        (slice(2, 3), options.min_turn, limits[:, 1]),
    ):
        to_and_fro = _goes_to_and_fro(off[:, columns], steps[:, columns], np.maximum(least, limit), options)
        is_noise[1:-1] |= to_and_fro
    # The poses beside may be off by less.
    is_noise[1:-1] |= is_noise[2:] | is_noise[:-2]
    stretches = [(int(rows[first]), int(rows[end - 1])) for first, end in mask_runs(is_noise)]
    if not stretches or np.count_nonzero(is_noise) > options.max_share * len(rows):
        return odometry, ""
    told = odometry.copy()
    for first, last in stretches:
        told[first : last + 1] = np.nan
    since = times - times[0]
    names = shortened_list([f"{since[first]:.1f} to {since[last]:.1f} s" for first, last in stretches])
    return told, (
        f"odometry goes to and fro as no robot drives, from {names} after its beginning: it is not used "
        "there, and steady motion takes its place; --as-recorded believes the log"
    )


def _goes_to_and_fro(off: Array, steps: Array, limits: Array, options: JitteryOdometryOptions) -> Mask:
    """(n,) which of successive poses are noise. They are `off` (n, d) a steady way, and robots may be off it
    by limits (n,), m or rad. `steps` (n, d) lead to the next poses."""
    size, sides = options.window, (off[1:] * off[:-1]).sum(axis=1)
    squares = (off**2).sum(axis=1)
    of_window = _sums(squares, size)
    alternates = _sums(sides, size - 1) < options.max_correlation * of_window
    alternates &= of_window > options.min_of_steps**2 * _sums((steps**2).sum(axis=1), size)
    cores, beside = (
        alternates & (_sums(squares > (share * limits) ** 2, size) >= least)
        for share, least in ((1.0, 2 * size / 3), (options.beside, size / 2))
    )
    is_far, is_noise = squares > (options.beside * limits) ** 2, np.zeros(len(off), dtype=np.bool_)
    for first, end in mask_runs(beside):
        if cores[first:end].any():
            # A window may begin before the noise does, and end before it ends.
            begin = max(first - size // 2, 0)
            within = begin + np.flatnonzero(is_far[begin : end + size + size // 2])
            is_noise[within[0] : within[-1] + 1] = True
    return is_noise


def _sums(values: Array | Mask, count: int) -> Array:
    """The sums of so many successive values (n,)."""
    found: Array = np.convolve(values, np.ones(count), "valid")
    return found
