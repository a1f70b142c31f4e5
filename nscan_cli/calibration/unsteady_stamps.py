"""Odometry that fits the scans at no offset of its stamps.

Some computers stamp scans when they come to read them, a few at a time and up to half a second late. Poses
that were recorded with such a scan are right beside it, but those that another clock or another node stamped
are compared with scans of other times, and moving all of them by the same time does not help.
"""

from __future__ import annotations

from nscan_cli.calibration.measured_steps import KnownSteps, MeasuredSteps, measure_steps
from nscan_cli.calibration.moved_stamps import with_delay
from nscan_cli.calibration.odometry_delay import TurnDelay, best_delay
from nscan_cli.calibration.odometry_fault_options import UnsteadyStampOptions
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.step_evidence import StepEvidence
from nscan_cli.calibration.step_sampling import telling_steps
from nscan_cli.logs.laser_log import LaserLog


def unsteady_delay(
    log: LaserLog, evidence: StepEvidence, options: FileCheckOptions, known: KnownSteps
) -> tuple[TurnDelay, int] | None:
    """The offset of odometry's stamps that fits best, and the number of steps that show that it does not fit
    even so; None if it does.

    More steps are measured only where those of the `evidence` do not fit as they are stamped. They are not
    blamed where scans measure few of them: what is left out there would be missed.
    """
    most = options.unsteady.max_disagreement
    if not _is_rough(evidence, options.unsteady):
        return None
    found = _best(log, evidence.both, options)
    if found is None or found.left <= most:
        return None
    first, last = telling_steps(log, options.steps, options.more_steps)
    steps = measure_steps(log, (first, last), options.steps, known=known, turns_alone=True)
    found = _best(log, steps, options)
    if found is None or found.left <= most or len(steps) < options.unsteady.min_measured_share * len(first):
        return None
    moved = with_delay(log, found.delay).at_middle_of_sweeps().odometry
    there = None if moved is None else StepEvidence(log, moved, steps, options)
    if there is None or not _is_rough(there, options.unsteady):
        return None
    tails = [fit.tail for fit in (there.fit, there.mirrored_fit) if fit is not None]
    are_off = bool(tails) and min(tails) > options.unsteady.max_tail
    return (found, there.moving) if are_off else None


def _is_rough(evidence: StepEvidence, options: UnsteadyStampOptions) -> bool:
    """Whether turns disagree as they are stamped, and no factor of them explains it."""
    turns = evidence.turns
    is_off = turns is not None and turns.steps >= options.min_turns and turns.spread > options.max_turn_spread
    return is_off and evidence.disagreement > options.max_disagreement


def _best(log: LaserLog, steps: MeasuredSteps, options: FileCheckOptions) -> TurnDelay | None:
    """The offset that fits best, also with mirrored scans."""
    found = [best_delay(log, steps, options.lag, sign) for sign in (1.0, -1.0)]
    return min((each for each in found if each is not None), key=lambda each: each.left, default=None)
