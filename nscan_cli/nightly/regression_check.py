"""Whether a log's last night was good: what the manifest expects, and what the night before had."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

from nscan_cli.nightly.manifest import ManifestEntry
from nscan_cli.nightly.run_history import RunRecord

Status = Literal["failed", "above", "worse", "good", "absent"]
"""In the order of how much they ask for a look."""
STATUS_ORDER: tuple[Status, ...] = ("failed", "above", "worse", "good", "absent")

ATTENTION: dict[Status, str] = {"failed": "failed", "above": "above bound", "worse": "worse than before"}
"""Those that ask for a look at all, in words."""

MIN_RELATIVE_RISE = 0.05
"""An error is worse than before when it has grown by more than this share of it,"""
MIN_TRANSLATION_RISE, MIN_ROTATION_RISE = 5e-4, 0.01
"""and by more than this (m, degrees): less is what another compiler's last digits can do."""


@dataclass(frozen=True)
class MeasuredErrors:
    """What bounds are held against: means on relations, RMSE of the ATE against a reference."""

    what: str
    translation: dict[str, float]
    """Figures in m: mean, sd, median, mean_square, rmse, max."""
    rotation: dict[str, float]
    """The same in degrees."""
    figure: str
    """Which of them counts."""

    @classmethod
    def of(cls, night: RunRecord | None) -> MeasuredErrors | None:
        """Those of a night; None where nothing was measured."""
        evaluation: dict[str, Any] = (night or {}).get("evaluation") or {}
        if "relations" in evaluation:
            of = evaluation["relations"]
            return cls("mean on relations", of["translation"], of["rotation"], "mean")
        if "reference" in evaluation:
            of = evaluation["reference"]["ate"]
            return cls("RMSE of the ATE", of["translation"], of["rotation"], "rmse")
        return None

    @property
    def metres(self) -> float:
        """The figure in m."""
        return self.translation[self.figure]

    @property
    def degrees(self) -> float:
        """The figure in degrees."""
        return self.rotation[self.figure]


@dataclass(frozen=True)
class CheckResult:
    """What is to be said of a log."""

    entry: ManifestEntry
    status: Status
    reasons: list[str]
    """One line each: why it is failed, above its bound, or worse."""
    nights: list[RunRecord]
    """Oldest first."""
    last: RunRecord | None
    """The last night that was done; the failed one of a failed log came after it."""
    before: RunRecord | None
    """The one done before that."""
    notes: list[str] = field(default_factory=list)
    """What is odd about the inputs."""

    @property
    def errors(self) -> MeasuredErrors | None:
        """Of the last night that was done."""
        return MeasuredErrors.of(self.last)

    @property
    def is_within_bounds(self) -> bool:
        """Whether there is a bound, and a figure that keeps to it."""
        bounds = (self.entry.max_translation, self.entry.max_rotation)
        return self.status in ("good", "worse") and self.errors is not None and bounds != (None, None)

    @property
    def is_failure(self) -> bool:
        """Whether a check failed."""
        return self.status in ("failed", "above")


def check_log(entry: ManifestEntry, nights: list[RunRecord], notes: list[str], absent: bool) -> CheckResult:
    """The verdict on a log of the manifest with these nights; one at least, unless it is absent."""
    done = [night for night in nights if night["outcome"] == "done"]
    last, before = (done[-1] if done else None), (done[-2] if len(done) > 1 else None)
    status: Status
    if absent:
        status, reasons = "absent", [f"{entry.inputs['log'].name} is not there"]
    else:
        status, reasons = _status_and_reasons(entry, nights, last, before)
    if last is not None:
        notes = [*notes, *last["counts"]["warnings"]]
    return CheckResult(entry, status, reasons, nights, last, before, notes)


def _status_and_reasons(
    entry: ManifestEntry, nights: list[RunRecord], last: RunRecord | None, before: RunRecord | None
) -> tuple[Status, list[str]]:
    if nights[-1]["outcome"] != "done":
        return "failed", [nights[-1]["reason"]]
    errors = MeasuredErrors.of(last)
    if errors is None:
        return "good", []
    above = [
        f"{errors.what} {figure:.4f} {unit} is above {bound:g} {unit}"
        for figure, bound, unit in (
            (errors.metres, entry.max_translation, "m"),
            (errors.degrees, entry.max_rotation, "degrees"),
        )
        if bound is not None and figure > bound
    ]
    if above:
        return "above", above
    earlier = MeasuredErrors.of(before)
    if earlier is None or earlier.what != errors.what:
        return "good", []
    worse = [
        f"{errors.what} rose from {old:.4f} to {new:.4f} {unit}"
        for old, new, least, unit in (
            (earlier.metres, errors.metres, MIN_TRANSLATION_RISE, "m"),
            (earlier.degrees, errors.degrees, MIN_ROTATION_RISE, "degrees"),
        )
        if new - old > max(least, MIN_RELATIVE_RISE * old)
    ]
    return ("worse" if worse else "good"), worse


def headline(verdicts: list[CheckResult]) -> str:
    """The whole night in a line."""
    count = {status: sum(each.status == status for each in verdicts) for status in STATUS_ORDER}
    there = len(verdicts) - count["absent"]
    parts = [f"{count[status]} {words}" for status, words in ATTENTION.items() if count[status]]
    of_all = f"of {there} {'log' if there == 1 else 'logs'}"
    if count["failed"] or count["above"]:
        return f"Not good: {of_all} {', '.join(parts)}"
    if parts:
        return f"Within bounds, but {of_all} {parts[0]}"
    within = sum(check_log.is_within_bounds for check_log in verdicts)
    if within == there:
        return "The log is good" if there == 1 else f"All {there} logs are good"
    if there == 1:
        return "The log is mapped; there is no bound to hold it against"
    others = "the others have" if within < there - 1 else "the other one has"
    of_them = f"{within} within {'its bound' if within == 1 else 'their bounds'}; {others} none"
    return f"All {there} logs are mapped, {of_them if within else 'without a bound to hold them against'}"
