"""Files of strangers: what they have wrong is read right, or said."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from nscan_cli.graph.io.load_graph import load_graph
from nscan_cli.graph.optimise.whole_graph import optimise_graph
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.data import data_file

pytestmark = pytest.mark.logs


def stranger(name: str) -> str:
    return str(data_file(f"strangers/{name}"))


def test_an_increment_that_contradicts_the_last_angle_yields_to_the_walls():
    log = read_log(stranger("contradict.mcap"))
    np.testing.assert_allclose(np.degrees(log.angle_increment), 1.0, rtol=1e-6)
    (warning,) = log.report.warnings
    assert "walls are straight with 1° per beam, which is used; --angle-increment 0.5 chooses" in warning
    asked = read_log(stranger("contradict.mcap"), ReadingOptions(angle_increment=np.radians(0.5)))
    np.testing.assert_allclose(np.degrees(asked.angle_increment), 0.5)


def test_readings_at_the_upper_limit_met_nothing():
    log = read_log(stranger("atmax.mcap"))
    assert np.isinf(log.ranges).mean() == pytest.approx(0.018, abs=0.001)
    assert float(log.ranges[np.isfinite(log.ranges)].max()) < 12.0


def test_a_mounting_that_rocks_is_its_mean():
    log = read_log(stranger("moving-tf.mcap"))
    assert log.mount[2] == pytest.approx(np.pi, abs=0.01)
    assert "tilts by up to 2.2°" in log.report.used["mounting"]


def test_what_a_write_ahead_log_holds_is_read():
    data_file("strangers/unmerged.db3-wal")
    log = read_log(stranger("unmerged.db3"))
    assert len(log) == 400
    assert log.report.warnings == ()


def test_information_that_is_indefinite_by_rounding_is_clipped():
    graph = load_graph(stranger("g2o/corridor_0.1_6.g2o"), [])
    optimum = optimise_graph(graph)
    assert optimum.energy == pytest.approx(38.98, abs=0.01)
    chain = load_graph(stranger("g2o/indef_rounding.g2o"), [])
    before = chain.poses
    optimise_graph(chain)
    assert np.abs((chain.poses - before)[:, :2]).max() < 0.001


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("landmark", ["1 EDGE_SE2_XY line skipped", "1 VERTEX_XY line skipped"]),
        ("prior", ["1 EDGE_PRIOR_SE2 line skipped"]),
        ("robust", ["1 EDGE_SE2_MIXTURE line skipped", "1 EDGE_SWITCHABLE line skipped"]),
        ("backend", ["1 EDGE_SWITCH_PRIOR line and 1 VERTEX_SWITCH line skipped"]),
        ("gtsam_x", []),
        ("se3", []),
    ],
)
def test_what_is_left_out_of_a_g2o_file_is_said(name, said):
    notices: list[str] = []
    graph = load_graph(stranger(f"g2o/{name}.g2o"), notices)
    assert len(graph.scans) == 200
    assert len(notices) == len(said)
    for notice, part in zip(notices, said, strict=True):
        assert part in notice


def test_nothing_is_corrected_as_recorded():
    for name in ("posts", "segments", "two-lasers-one-frame"):
        log = read_log(stranger(f"{name}.mcap"), dataclasses.replace(ReadingOptions(), as_recorded=True))
        assert log.report.contradictions == ()
