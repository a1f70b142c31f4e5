from __future__ import annotations

from pathlib import Path

import pytest

from nscan_cli.nightly.manifest import ManifestEntry
from nscan_cli.nightly.regression_check import CheckResult, check_log, headline
from nscan_cli.nightly.run_history import RunRecord


def figures(value: float) -> dict[str, float]:
    return dict.fromkeys(("mean", "sd", "median", "mean_square", "rmse", "max"), value)


def done(translation: float, rotation: float = 0.1) -> RunRecord:
    evaluation = {"relations": {"translation": figures(translation), "rotation": figures(rotation)}}
    return {"key": "", "tool": "", "outcome": "done", "counts": {"warnings": []}, "evaluation": evaluation}


FAILED = {
    "key": "",
    "tool": "",
    "outcome": "failed",
    "reason": "it died",
    "times": {"finished": "2026-11-21T03:00:00Z"},
}


UNMEASURED = {**done(1.0), "evaluation": None}


def judged(
    *nights: RunRecord, translation: float | None = None, rotation: float | None = None, absent: bool = False
) -> CheckResult:
    entry = ManifestEntry("a", {"log": Path("a.log"), "relations": Path("r")}, translation, rotation)
    return check_log(entry, list(nights), [], absent)


@pytest.mark.parametrize(
    ("found", "status", "reasons"),
    [
        (judged(done(0.02), translation=0.02), "good", []),
        (judged(done(0.021), translation=0.02), "above", ["mean on relations 0.0210 m is above 0.02 m"]),
        (judged(done(0.02, 0.5), rotation=0.4), "above",
         ["mean on relations 0.5000 degrees is above 0.4 degrees"]),
        (judged(FAILED), "failed", ["it died"]),
        (judged(done(0.02), FAILED, translation=0.01), "failed", ["it died"]),
        (judged(FAILED, done(0.02)), "good", []),
        (judged(done(0.02), done(0.0209)), "good", []),
        (judged(done(0.02), done(0.0212)), "worse", ["mean on relations rose from 0.0200 to 0.0212 m"]),
        (judged(done(0.002), done(0.0024)), "good", []),
        (judged(done(0.02), FAILED, done(0.03)), "worse", ["mean on relations rose from 0.0200 to 0.0300 m"]),
        (judged(done(0.02, 0.1), done(0.02, 0.2)), "worse",
         ["mean on relations rose from 0.1000 to 0.2000 degrees"]),
        (judged(done(0.03), done(0.02)), "good", []),
        (judged(done(0.02), done(0.03), translation=0.025), "above",
         ["mean on relations 0.0300 m is above 0.025 m"]),
        (judged(absent=True), "absent", ["a.log is missing"]),
        (judged(done(0.1), absent=True, translation=0.05), "absent", ["a.log is missing"]),
    ],
)  # fmt: skip
def test_the_verdict(found, status, reasons):
    assert (found.status, found.reasons) == (status, reasons)
    assert found.is_failure == (status in ("failed", "above"))


def test_a_log_without_anything_to_measure_against_is_good_when_it_is_done():
    assert judged(UNMEASURED).status == "good"


@pytest.mark.parametrize(
    ("greatest", "status", "reasons"),
    [
        (0.2, "good", []),
        (0.4, "above", ["mapped again, maps differ by 0.4000 m, above 0.3 m"]),
        (None, "above", ["mapped again, no way could be compared"]),
    ],
)
def test_maps_of_the_same_drive_have_to_be_the_same(greatest, status, reasons):
    for run in (done(0.02), UNMEASURED):
        counts = {"warnings": [], "verification": {"greatest": greatest, "bound": 0.3}}
        found = judged({**run, "counts": counts})
        assert (found.status, found.reasons) == (status, reasons)


def test_of_a_trajectory_the_rmse_counts():
    ate = {"translation": {**figures(0.1), "rmse": 0.3}, "rotation": figures(1.0)}
    found = judged({**done(0), "evaluation": {"reference": {"ate": ate}}}, translation=0.2)
    assert found.reasons == ["RMSE of the ATE 0.3000 m is above 0.2 m"]


@pytest.mark.parametrize(
    ("verdicts", "line"),
    [
        ([judged(done(1), translation=2)], "The log is good"),
        ([judged(done(1), rotation=2)] * 3 + [judged(absent=True)], "All 3 logs are good"),
        ([judged(done(1)), judged(done(1), done(2))], "1 of 2 logs is worse than before"),
        ([judged(FAILED), judged(done(2), translation=1), judged(done(1), done(2)), judged(done(1))],
         "1 of 4 logs failed, 1 is above its bound, 1 is worse than before"),
        ([judged(FAILED)], "The log failed"),
        ([judged(UNMEASURED, translation=2)], "The log is mapped; it has no bound"),
        ([judged(UNMEASURED), judged(done(1))],
         "All 2 logs are mapped, none has a bound"),
        ([judged(UNMEASURED), judged(done(1)), judged(done(1), translation=2)],
         "All 3 logs are mapped, 1 within its bound, 2 without a bound"),
        ([judged(UNMEASURED)] + [judged(done(1), translation=2)] * 2,
         "All 3 logs are mapped, 2 within their bounds, 1 without a bound"),
    ],
)  # fmt: skip
def test_the_headline(verdicts, line):
    assert headline(verdicts) == line
