"""`nscan-cli nscan` on scans that do not belong to the others, or hardly."""

from __future__ import annotations

import numpy as np
import pytest

from nscan_cli.cli.main import run
from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.graph.model import Pairwise
from nscan_cli.poses import relative
from tests.cli.test_nscan import SCANS, SPEC, assert_true, graph_of, matched
from tests.data import CORRIDOR_LOG, OFFICE_LOG


def test_scans_that_cannot_meet_the_others_are_named_and_left_out(tmp_path, capsys, office):
    graph = graph_of(office, SCANS)
    graph.poses[1] += [300.0, 0, 0]
    path = tmp_path / "torn.json"
    path.write_bytes(write_graph(graph))
    arguments = ["--scans", SPEC, "--initial", str(path), "--prior", "none", "--fixed", "2008"]
    document, said = matched(capsys, OFFICE_LOG, *arguments)
    assert document["relation"]["scans"] == [2000, 2016, 2024]
    assert document["relation"]["fixed"] == 2000
    reason = "starts too far from all other scans to overlap any"
    assert document["left_out"] == [{"scan": 2008, "reason": reason, "overlap": 0, "chi2": None}]
    assert len(document["relation"]["hessian"]) == 45
    assert len(document["covariance"]) == 21
    assert said[-1] == f"left out  scan 2008 {reason}"
    assert_true(document, office)
    code = run(["nscan", OFFICE_LOG, "--scans", "2000,2008", *arguments[2:6]])
    out, err = capsys.readouterr()
    assert (code, out, len(err.splitlines())) == (65, "", 1)
    assert f"no two of the scans match: scan 2000 {reason}" in err


def test_a_scan_out_of_its_bounds_is_named_with_its_deviation(tmp_path, capsys, office):
    """The graph's relations put scan 2016 half a metre aside, and are met by all others."""
    graph = graph_of(office, SCANS)
    graph.poses[2, 1] += 0.5
    for a, b in ((0, 1), (1, 2), (2, 3), (1, 3)):
        step = relative(graph.poses[b], graph.poses[a])
        graph.pairwise.append(Pairwise((a, b), step, np.eye(3) * 400, "track"))
    path = tmp_path / "graph.json"
    path.write_bytes(write_graph(graph))
    document, said = matched(capsys, OFFICE_LOG, "--scans", SPEC, "--prior", str(path))
    (out,) = document["left_out"]
    # One prior of the two that it breaks, 0.5 m at 0.05 m.
    assert (out["scan"], out["chi2"]) == (2016, pytest.approx(100, rel=0.1))
    assert out["reason"] == f"contradicts its priors (χ² {out['chi2']:.1f}, at most 16.27)"
    assert said[-1].split() == f"left out scan 2016 {out['reason']}".split()
    assert max(map(len, said)) <= 80
    assert_true(document, office)


def test_a_weak_direction_is_named(capsys):
    """Scans 1 and 2 of Fig. 3 leave the corridor's direction open."""
    document, said = matched(capsys, CORRIDOR_LOG, "--scans", "45,117")
    assert document["left_out"] == []
    for weakest in document["weakest"]:
        assert weakest["sigma"] > 0.05
        assert abs(weakest["direction"]) < 0.1
    first, second = (f"σ {weakest['sigma']:.2g} m" for weakest in document["weakest"])
    weak = said[-2:]
    assert weak[0].startswith("weak     scan 45 along ")
    assert weak[0].endswith(f"({first})")
    assert weak[1].startswith("         scan 117 along ")
    assert weak[1].endswith(f"({second})")
