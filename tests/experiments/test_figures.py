"""What the paper says of its figures, said of ours."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.experiments import __main__ as experiments
from tests.experiments import fig_2, fig_3, fig_4, fig_5, gauge, reference_logs
from tests.experiments.cases import SUCCESS, Outcome, farthest
from tests.experiments.gauge import Convergence
from tests.experiments.report import Report


def gap(which: tuple[int, ...]) -> float:
    """How much higher the second-lowest minimum is, as a share of the lowest."""
    lowest, second = fig_2.minima(*which)[:2]
    return (second.energy - lowest.energy) / abs(lowest.energy)


@pytest.mark.parametrize("pair", fig_2.PAIRS)
def test_fig_2_any_two_shapes_match_in_two_ways(pair):
    assert gap(pair) < 0.02
    lowest, second, *others = fig_2.minima(*pair)
    # One of the two is right; both are sharp, and nothing else comes near.
    assert min(abs(lowest.shifts[0]), abs(second.shifts[0])) < 0.05
    assert min(lowest.least_eigenvalue, second.least_eigenvalue) > 1e4
    assert all(other.energy > lowest.energy + 0.12 * abs(lowest.energy) for other in others)


def test_fig_2_all_three_shapes_match_in_one_way():
    lowest = fig_2.minima(0, 1, 2)[0]
    assert np.abs(lowest.shifts).max() < 0.02
    assert gap((0, 1, 2)) > 3 * max(gap(pair) for pair in fig_2.PAIRS)
    joint = fig_2.joint_energies()
    c, b = np.unravel_index(joint.argmin(), joint.shape)
    assert fig_2.SHIFTS[[b, c]] == pytest.approx([0, 0], abs=0.026)


@pytest.mark.parametrize(("pair", "open_way"), [((0, 1), 0.0), ((0, 2), 90.0)])
def test_fig_3_pairs_with_the_first_scan_leave_a_direction_open(pair, open_way):
    found = fig_3.subset(pair)
    assert found.eigenvalues[0] < 0.01 * found.eigenvalues[1]
    off = np.degrees(found.weakest[0].direction) - open_way
    assert abs((off + 90) % 180 - 90) < 5
    assert found.weakest[0].sigma is None or found.weakest[0].sigma > SUCCESS


def test_fig_3_all_three_leave_nothing_open_but_the_gauge():
    whole, pairs = fig_3.subset((0, 1, 2)), [fig_3.subset(pair) for pair in ((0, 1), (0, 2))]
    assert whole.eigenvalues[0] > 30 * max(pair.eigenvalues[0] for pair in pairs)
    for weakest, pair in zip(whole.weakest, pairs, strict=True):
        assert weakest.sigma is not None
        assert pair.weakest[0].sigma is not None
        assert weakest.sigma < 0.15 * pair.weakest[0].sigma
    assert whole.error < 0.05
    assert min(pair.usual_error for pair in pairs) > 4 * whole.usual_error
    # At a minimum: elsewhere the turn of all scans has the curvature that the gradient gives it.
    assert fig_3.joint().gradient_norm < 1e-3
    free = fig_3.free_eigenvalues()
    assert np.abs(free[:3]).max() < 1e-6 * free[3]


@pytest.mark.parametrize(("moved", "axis"), [(1, 0), (2, 1)])
def test_fig_3_a_shift_that_a_pair_leaves_open_costs_with_all_three(moved, axis):
    pair, whole = (fig_3.profile(which, moved, axis) for which in ((0, moved), (0, 1, 2)))
    far = np.abs(fig_3.SHIFTS) > 0.1
    assert (whole[far] - whole.min()).min() > 2 * np.abs(pair[far] - pair.min()).max()


def check(outcome: Outcome) -> None:
    """All scans are where they were taken after the match, and were not before it."""
    assert farthest(outcome.before) > 5 * SUCCESS
    for matched in (outcome.free, outcome.fixed):
        assert matched.succeeded()
        assert matched.match.reason is None
    assert outcome.from_good.converged
    assert outcome.from_good.last_iterations <= 10


@pytest.mark.parametrize("figure", [fig_4, fig_5])
def test_scans_of_the_office_find_their_places(figure):
    check(figure.outcomes()[0])


@pytest.mark.logs
@pytest.mark.parametrize("figure", [fig_4, fig_5])
def test_scans_of_intel_find_their_places(figure):
    if reference_logs.reference_log("intel") is None:
        pytest.skip("intel is not there")
    check(figure.outcomes()[1])


def check_gauges(free: Convergence, fixed: Convergence) -> None:
    """The paper, III-D: a free gauge converges in fewer iterations, and as often but for one of 40."""
    assert free.iterations() < 0.95 * fixed.iterations()
    assert free.success() >= fixed.success() - 0.025
    assert free.success() > 0.6


def test_in_the_office_a_free_gauge_converges_in_fewer_iterations():
    check_gauges(*gauge.office_set())


@pytest.mark.logs
def test_on_intel_a_free_gauge_converges_in_fewer_iterations():
    found = gauge.intel_set()
    if found is None:
        pytest.skip("intel is not there")
    check_gauges(*found)


def test_without_the_real_logs_the_reports_say_so(tmp_path, monkeypatch):
    monkeypatch.setenv("NSCAN_DATA", str(tmp_path))
    for cached in (reference_logs.reference_log, fig_4.outcomes):
        cached.cache_clear()
    try:
        report = fig_4.report()
    finally:
        for cached in (reference_logs.reference_log, fig_4.outcomes):
            cached.cache_clear()
    assert list(report.pictures) == ["fig_4_office"]
    assert [row[0] for row in report.rows] == ["simulated office", "the paper's"]
    assert "intel" in report.left_out[0]


def test_pictures_and_the_document_are_written_the_same_twice(tmp_path: Path, monkeypatch):
    monkeypatch.setattr(experiments, "EXPERIMENTS", (fig_3.report,))
    written = []
    for name in ("first", "second"):
        folder = tmp_path / name / "pictures"
        folder.mkdir(parents=True)
        for cached in (fig_3.scans, fig_3.joint):
            cached.cache_clear()
        experiments.main(str(folder))
        document = folder.parent / "experiments.md"
        assert "(pictures/fig_3.png)" in document.read_text(encoding="utf-8")
        picture = (folder / "fig_3.png").read_bytes()
        assert len(picture) < 150_000
        written.append((document.read_bytes(), picture))
    assert written[0] == written[1]


def test_every_report_is_whole():
    for report in (fig_2.report(), fig_5.report()):
        assert isinstance(report, Report)
        assert all(len(row) == len(report.header) for row in report.rows)
        assert report.pictures
