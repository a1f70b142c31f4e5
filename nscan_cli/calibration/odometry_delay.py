"""How late the odometry is against the scans, by a tenth of a second or more, with any laser.

The steps that the check of a file measures tell it: their turns by scans fit best to those by odometry some
time before or after. Where odometry is late, the robot still drives in it when it stands in the scans.
sweep_delay.py finds shorter delays, by the sweeps of a turning laser; clock_offset.py looks for two clocks
that differ by up to two minutes, of which a warning tells, or which `calibrate` measures.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nscan_cli.calibration.measured_steps import KnownSteps, MeasuredSteps, measure_steps
from nscan_cli.calibration.moved_stamps import with_delay
from nscan_cli.calibration.odometry_options import DelayOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.parabola import parabola_minimum
from nscan_cli.calibration.step_sampling import telling_steps
from nscan_cli.calibration.turn_differences import turn_differences
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import Array, Indices


def checked_delay(
    log: LaserLog, reading: ReadingOptions, known: KnownSteps, options: FileCheckOptions
) -> tuple[LaserLog, ReadingOptions, list[str]]:
    """The log with the delay of its odometry put right, the options that read it so, and messages.

    More steps are measured only if those that are `known` show a delay.
    """
    if log.odometry is None or reading.clock_offset:
        return log, reading, []
    rows = np.array([pair for pair, step in known.items() if step is not None], dtype=np.int64).reshape(-1, 2)
    turned = np.array([step[0][2] for step in known.values() if step is not None])
    lag = options.lag
    first = replace(lag, min_turns=lag.first_turns, sigmas=lag.first_sigmas)
    if not _delay(log, rows[:, 0], rows[:, 1], turned, first):
        return log, reading, []
    steps = measure_steps(
        log, telling_steps(log, options.steps, options.more_steps), options.steps, known=known
    )
    delay = _delay(log, steps.first, steps.last, steps.laser[:, 2], lag)
    if not delay:
        return log, reading, []
    reading = replace(reading, clock_offset=delay)
    return with_delay(log, delay), reading, [said_late(delay, delay, "because scans are matched by odometry")]


class TurnDelay(NamedTuple):
    """The delay with which turns by odometry fit best to those by scans."""

    delay: float
    """s to add to the stamps of odometry."""
    left: float
    """Sum of the differences of turns with it, as a share of the turns by scans; each is capped."""
    as_stamped: float
    """This share without a delay."""
    sigmas: float
    """Mean gain of the turns with it, in its standard deviations."""
    is_between: bool
    """Whether longer delays were tried on both sides."""


def best_delay(log: LaserLog, steps: MeasuredSteps, options: DelayOptions, sign: float) -> TurnDelay | None:
    """The delay of the odometry by steps of its scans; None for few turns. `sign` −1: of mirrored scans."""
    return _best_delay(log, steps.first, steps.last, sign * steps.laser[:, 2], options)


def _delay(log: LaserLog, first: Indices, last: Indices, turned: Array, options: DelayOptions) -> float:
    """Seconds to add to the stamps of odometry, so that its turns fit those (n,) of the steps from rows to
    rows (n,); 0 in doubt."""
    found = _best_delay(log, first, last, turned, options)
    if found is None or not found.is_between or found.sigmas < options.sigmas:
        return 0.0
    is_clear = found.left <= min(options.max_left * found.as_stamped, options.max_disagreement)
    return found.delay if is_clear and abs(found.delay) >= options.least else 0.0


def _best_delay(
    log: LaserLog, first: Indices, last: Indices, turned: Array, options: DelayOptions
) -> TurnDelay | None:
    at, poses = log.known_odometry()
    turns = np.abs(turned) >= options.min_turn
    if np.count_nonzero(turns) < options.min_turns or not len(at):
        return None
    known = at, np.unwrap(poses[:, 2])
    count = round(options.longest / options.step)
    delays = options.step * np.arange(-count, count + 1, dtype=np.float64)
    steps, turned = (log.middle_times[first[turns]], log.middle_times[last[turns]]), turned[turns]
    # A match that failed, or a wheel that slipped, counts for no more than another turn.
    off = np.minimum(turn_differences(known, steps, turned, delays), options.max_difference)
    total = off.mean(axis=1)
    best = int(np.argmin(total))
    gains = off[count] - off[best]
    sigma = float(gains.std(ddof=1)) / np.sqrt(len(gains))
    whole = float(np.minimum(np.abs(turned), options.max_difference).mean())
    return TurnDelay(
        round(parabola_minimum(delays, total, options.fitted), 2),
        float(total[best]) / whole,
        float(total[count]) / whole,
        float(gains.mean()) / sigma if sigma > 0.0 else 0.0,
        0 < best < 2 * count,
    )


def said_late(delay: float, offset: float, why: str) -> str:
    """The message on odometry that is stamped too early by `delay` (s): the option moves it by `offset`."""
    side = "early" if delay > 0.0 else "late"
    return (
        f"odometry is stamped {abs(delay):.2g} s too {side}, by the turns of the scans; its stamps are "
        f"moved, as with --clock-offset {offset:.2g}, {why}; --as-recorded believes the file"
    )
