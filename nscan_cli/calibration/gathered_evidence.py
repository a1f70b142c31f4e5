"""The steps of a log that tell what its file says wrongly: few where all is well, more where in doubt."""

from __future__ import annotations

from collections.abc import Iterator

from nscan_cli.calibration.measured_steps import KnownSteps, measure_steps
from nscan_cli.calibration.options import FileCheckOptions
from nscan_cli.calibration.step_evidence import (
    StepEvidence,
    agrees_clearly,
    is_change,
    is_view_in_doubt,
    is_wrong_scale,
    never_changes,
)
from nscan_cli.calibration.step_sampling import telling_steps
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.poses import Array


def gathered_evidence(
    log: LaserLog, odometry: Array, options: FileCheckOptions, known: KnownSteps
) -> StepEvidence | None:
    """The steps of a sample, which is larger where scans tell few of them, as outdoors.

    None if a part of it clearly agrees with the file already: the rest is not measured.
    """
    count, most = options.steps.count, min(int(0.5 * options.max_share * len(log)), options.more_steps)
    while True:
        for evidence in _growing(log, odometry, count, options.parts, options, known):
            if agrees_clearly(evidence, log.mount, options):
                return None
        if evidence.tells_enough or count >= most:
            break
        count = min(2 * count, most)
    if count < options.more_steps and _is_in_doubt(evidence, log.mount, options):
        # What changes within the log is seen in a few steps only.
        may_change = is_change(evidence.change, options, options.change.doubt_sigmas)
        may_change |= is_view_in_doubt(evidence, log.mount, options)
        for evidence in _growing(log, odometry, options.more_steps, options.more_parts, options, known):
            is_settled = not may_change and evidence.tells_enough
            if is_settled and not _is_in_doubt(evidence, log.mount, options):
                break
    return evidence


def _growing(
    log: LaserLog, odometry: Array, count: int, parts: int, options: FileCheckOptions, known: KnownSteps
) -> Iterator[StepEvidence]:
    """The evidence of one of the parts of a sample of `count` steps, of two of them, and so on."""
    steps, (first, last) = None, telling_steps(log, options.steps, count)
    for part in range(parts):
        some = slice(part, None, parts)
        more = measure_steps(log, (first[some], last[some]), options.steps, known=known, turns_alone=True)
        steps = more if steps is None else steps.with_others(more)
        yield StepEvidence(log, odometry, steps, options)


def _is_in_doubt(evidence: StepEvidence, mount: Array, options: FileCheckOptions) -> bool:
    """Whether a few more steps may tell: the scale of odometry is wrong by no more than the wheels of some
    robots are, or the laser, mounted at (3,), was perhaps turned, or the few turns are opposite."""
    fit, turning = evidence.fit, evidence.turning
    if is_view_in_doubt(evidence, mount, options):
        return True
    if turning < options.min_steps:
        is_opposite = evidence.opposite_share >= options.min_opposite_share
        if (is_opposite and turning >= options.view.doubt_steps) or (
            never_changes(evidence.poses, options.still)[2]
        ):
            return True
    if _may_turn_otherwise(evidence, options):
        return True
    if fit is None:
        return False
    is_odd = is_wrong_scale(fit, options) and max(fit.scale, 1.0 / fit.scale) < options.clear_scale_factor
    return is_odd or is_change(evidence.change, options, options.change.doubt_sigmas)


def _may_turn_otherwise(evidence: StepEvidence, options: FileCheckOptions) -> bool:
    """Whether odometry turns otherwise than the scans, which turn in too few steps to tell how.

    Turns by odometry alone count as well: its clock may be another one.
    """
    count, off = evidence.unlike_turns
    is_off = count >= options.min_turns_unmeasured and off > options.max_turn_error
    return is_off and evidence.turning < options.min_steps
