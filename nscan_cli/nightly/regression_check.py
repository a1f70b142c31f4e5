"""Whether a log's last run is good: within the bounds of the manifest, and no worse than the run before."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

from nscan_cli.nightly.manifest import ManifestEntry
from nscan_cli.nightly.run_history import RunRecord

Status = Literal["failed", "above", "worse", "good", "absent"]
"""What a check says of a log."""
STATUS_ORDER: tuple[Status, ...] = ("failed", "above", "worse", "good", "absent")
"""The most urgent first."""
ATTENTION: dict[Status, tuple[str, str]] = {
    "failed": ("failed", "failed"),
    "above": ("is above its bound", "are above their bound"),
    "worse": ("is worse than before", "are worse than before"),
}
"""The words for each status that needs attention, for one log and for several."""


@dataclass(frozen=True)
class RegressionOptions:
    """When the errors of a log are worse than those of the run before."""

    relative_rise: float = 0.05
    """Least rise of an error, as a share of the previous one. A larger value calls fewer logs worse."""
    translation_rise: float = 5e-4
    """Least rise of a translational error, m: rounding alone can cause less. A larger value calls fewer logs
    worse."""
    rotation_rise: float = 0.01
    """Least rise of a rotational error, degrees: rounding alone can cause less. A larger value calls fewer
    logs worse."""


@dataclass(frozen=True)
class MeasuredErrors:
    """The errors of a run; one statistic of them is compared with the bounds."""

    measure: str
    """The name of what is compared: mean on relations, or RMSE of the ATE."""
    translation: dict[str, float]
    """Statistics of the translational errors, m: mean, sd, median, mean_square, rmse, max."""
    rotation: dict[str, float]
    """The same statistics of the rotational errors, degrees."""
    statistic: str
    """The key of the statistic that is compared."""

    @classmethod
    def of(cls, run: RunRecord | None) -> MeasuredErrors | None:
        """The errors of a run; None if nothing was measured."""
        evaluation: dict[str, Any] = (run or {}).get("evaluation") or {}
        if "relations" in evaluation:
            of = evaluation["relations"]
            return cls("mean on relations", of["translation"], of["rotation"], "mean")
        if "reference" in evaluation:
            of = evaluation["reference"]["ate"]
            return cls("RMSE of the ATE", of["translation"], of["rotation"], "rmse")
        return None

    @property
    def metres(self) -> float:
        """The compared translational error, m."""
        return self.translation[self.statistic]

    @property
    def degrees(self) -> float:
        """The compared rotational error, degrees."""
        return self.rotation[self.statistic]


@dataclass(frozen=True)
class CheckResult:
    """The result of the check of a log."""

    entry: ManifestEntry
    status: Status
    reasons: list[str]
    """Why the log failed, is above its bound, or is worse; one line each."""
    runs: list[RunRecord]
    """Oldest first."""
    last: RunRecord | None
    """The last run that did not fail."""
    previous: RunRecord | None
    """The run before `last` that did not fail."""
    notes: list[str] = field(default_factory=list)
    """Warnings about the inputs and of the last run."""

    @property
    def errors(self) -> MeasuredErrors | None:
        """The errors of the last run that did not fail."""
        return MeasuredErrors.of(self.last)

    @property
    def is_within_bounds(self) -> bool:
        """Whether the log has a bound and a measured error that is not above it."""
        bounds = (self.entry.max_translation, self.entry.max_rotation)
        return self.status in ("good", "worse") and self.errors is not None and bounds != (None, None)

    @property
    def is_failure(self) -> bool:
        """Whether this result makes the command fail."""
        return self.status in ("failed", "above")


def check_log(entry: ManifestEntry, runs: list[RunRecord], notes: list[str], absent: bool) -> CheckResult:
    """Check a log of the manifest. It has at least one run, unless it is `absent`."""
    done = [run for run in runs if run["outcome"] == "done"]
    last, previous = (done[-1] if done else None), (done[-2] if len(done) > 1 else None)
    status: Status
    if absent:
        status, reasons = "absent", [f"{entry.inputs['log'].name} is missing"]
    else:
        status, reasons = _status_and_reasons(entry, runs, last, previous)
    if last is not None:
        notes = [*notes, *last["counts"]["warnings"]]
    return CheckResult(entry, status, reasons, runs, last, previous, notes)


def _status_and_reasons(
    entry: ManifestEntry, runs: list[RunRecord], last: RunRecord | None, previous: RunRecord | None
) -> tuple[Status, list[str]]:
    if runs[-1]["outcome"] != "done":
        return "failed", [runs[-1]["reason"]]
    errors, above = MeasuredErrors.of(last), _above_verify_bound(last)
    if errors is None:
        return ("above" if above else "good"), above
    above += [
        f"{errors.measure} {figure:.4f} {unit} is above {bound:g} {unit}"
        for figure, bound, unit in (
            (errors.metres, entry.max_translation, "m"),
            (errors.degrees, entry.max_rotation, "degrees"),
        )
        if bound is not None and figure > bound
    ]
    if above:
        return "above", above
    earlier = MeasuredErrors.of(previous)
    if earlier is None or earlier.measure != errors.measure:
        return "good", []
    options = RegressionOptions()
    worse = [
        f"{errors.measure} rose from {old:.4f} to {new:.4f} {unit}"
        for old, new, least, unit in (
            (earlier.metres, errors.metres, options.translation_rise, "m"),
            (earlier.degrees, errors.degrees, options.rotation_rise, "degrees"),
        )
        if new - old > max(least, options.relative_rise * old)
    ]
    return ("worse" if worse else "good"), worse


def _above_verify_bound(last: RunRecord | None) -> list[str]:
    """Why the maps of the same drive differ too much, if the manifest asked for them."""
    verification: dict[str, Any] | None = (last or {}).get("counts", {}).get("verification")
    if verification is None:
        return []
    greatest, bound = verification["greatest"], verification["bound"]
    if greatest is None:
        return ["mapped again, no way could be compared"]
    return [f"mapped again, maps differ by {greatest:.4f} m, above {bound:g} m"] if greatest > bound else []


def headline(checks: list[CheckResult]) -> str:
    """The results of all logs in one line."""
    count = {status: sum(check.status == status for check in checks) for status in STATUS_ORDER}
    there = len(checks) - count["absent"]
    parts = [
        (count[status], words[count[status] > 1]) for status, words in ATTENTION.items() if count[status]
    ]
    if parts:
        (first, words), *others = parts
        begin = f"{first} of {there} logs {words}" if there > 1 else f"The log {words}"
        return ", ".join([begin, *(f"{number} {words}" for number, words in others)])
    within = sum(check.is_within_bounds for check in checks)
    if within == there:
        return "The log is good" if there == 1 else f"All {there} logs are good"
    if there == 1:
        return "The log is mapped; it has no bound"
    of_them = (
        f"{within} within {'its bound' if within == 1 else 'their bounds'}, {there - within} without a bound"
    )
    return f"All {there} logs are mapped, {of_them if within else 'none has a bound'}"
