"""How late the odometry is against the scans, by a tenth of a second or more, with any laser.

Turns by scans, of the steps that the check of a file measures or of a finished map, tell it: they fit best to
those by odometry some time before or after. Where odometry is late, the robot still drives in it when it
stands in the scans. sweep_delay.py finds shorter delays, by the sweeps of a turning laser; clock_offset.py
looks for two clocks that differ by up to two minutes.
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
from nscan_cli.calibration.turn_differences import Turns, turn_differences
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.reading_options import ReadingOptions


def checked_delay(
    log: LaserLog, reading: ReadingOptions, known: KnownSteps, options: FileCheckOptions
) -> tuple[LaserLog, float]:
    """The log with the delay of its odometry put right, and the seconds that were added to its stamps.

    More steps are measured only if those that are `known` show a delay.
    """
    if log.odometry is None or reading.clock_offset:
        return log, 0.0
    lag = options.lag
    first = replace(lag, min_turns=lag.first_turns, sigmas=lag.first_sigmas)
    if not delay_by_turns(log, Turns.of_known(known, log.middle_times), first):
        return log, 0.0
    steps = measure_steps(
        log, telling_steps(log, options.steps, options.more_steps), options.steps, known=known
    )
    delay = delay_by_turns(log, Turns.of_steps(steps, log.middle_times), lag)
    return (with_delay(log, delay), delay) if delay else (log, 0.0)


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
    begins, ends, turned = Turns.of_steps(steps, log.middle_times)
    return _best_delay(log, Turns(begins, ends, sign * turned), options)


def delay_by_turns(log: LaserLog, turns: Turns, options: DelayOptions) -> float:
    """Seconds to add to the stamps of odometry, so that its turns fit those by scans; 0 in doubt."""
    found = _best_delay(log, turns, options)
    if found is None or not found.is_between or found.sigmas < options.sigmas:
        return 0.0
    is_clear = found.left <= min(options.max_left * found.as_stamped, options.max_disagreement)
    return found.delay if is_clear and abs(found.delay) >= options.least else 0.0


def _best_delay(log: LaserLog, turns: Turns, options: DelayOptions) -> TurnDelay | None:
    at, poses = log.known_odometry()
    begins, ends, turned = turns.of_at_least(options.min_turn)
    if len(turned) < options.min_turns or not len(at):
        return None
    known = at, np.unwrap(poses[:, 2])
    count = round(options.longest / options.step)
    delays = options.step * np.arange(-count, count + 1, dtype=np.float64)
    # A match that failed, or a wheel that slipped, counts for no more than another turn.
    off = np.minimum(turn_differences(known, (begins, ends), turned, delays), options.max_difference)
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
        f"moved, as with --clock-offset {offset:g}, {why}; --as-recorded believes the file"
    )
