from __future__ import annotations

import gzip
import io
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from nscan_cli.errors import InputDataError, InputMissingError
from nscan_cli.evaluation.load_trajectory import load_reference, load_trajectory
from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.graph.io.tum import write_tum
from nscan_cli.logs.reading_options import ReadingOptions
from tests.graph.small_graph import small_graph

# Two scans of three beams; the robot's pose is the second triple, the truth says twice as far.
LOG = """\
FLASER 3 1.0 2.0 3.0 1.0 0.0 0.5 1.0 0.0 0.5 100.5 host 0.5
TRUEPOS 2.0 0.0 1.0 1.0 0.0 0.5 100.5 host 0.5
FLASER 3 1.0 2.0 3.0 2.0 0.0 0.5 2.0 0.0 0.5 101.5 host 1.5
TRUEPOS 4.0 0.0 1.0 2.0 0.0 0.5 101.5 host 1.5
"""


def write(tmp_path: Path, data: bytes) -> str:
    path = tmp_path / "without-a-telling-name"
    path.write_bytes(data)
    return str(path)


def test_a_graph_gives_the_poses_of_all_scans(tmp_path: Path):
    trajectory = load_trajectory(write(tmp_path, write_graph(small_graph())))
    assert trajectory.stamps == tuple(small_graph().stamps)
    np.testing.assert_allclose(trajectory.poses[:, :2], [[0.0, 0.0], [1.0, 0.25], [2.0, 0.5]])


@pytest.mark.parametrize("before", [b"", b"# t x y z qx qy qz qw\n\n"])
def test_a_tum_file_is_known_by_its_numbers(tmp_path: Path, before: bytes):
    data = before + write_tum(["5", "6"], np.array([[1.0, 2, 3], [4, 5, -1]]))
    for packed in (data, gzip.compress(data)):
        np.testing.assert_allclose(
            load_trajectory(write(tmp_path, packed)).poses, [[1, 2, 3], [4, 5, -1]], atol=1e-8
        )


def test_a_log_gives_the_poses_of_its_robot_or_the_true_ones(tmp_path: Path):
    path = write(tmp_path, LOG.encode())
    np.testing.assert_allclose(load_trajectory(path).poses, [[1, 0, 0.5], [2, 0, 0.5]])
    reference = load_reference(path)
    np.testing.assert_allclose(reference.poses, [[2, 0, 1], [4, 0, 1]])
    np.testing.assert_allclose(reference.times, [100.5, 101.5])


def test_a_log_without_true_poses_is_no_reference(tmp_path: Path):
    log = "".join(line for line in LOG.splitlines(keepends=True) if line.startswith("FLASER"))
    with pytest.raises(InputDataError, match="the log has no true poses"):
        load_reference(write(tmp_path, log.encode()))


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        (b"", "is empty; give a graph, a TUM file or a log"),
        (b"{}", "'format' is not 'nscan-pose-graph'"),
        (b"1 2 3\n", "line 1: 3 columns instead of 8"),
        (b"hello world\n", "of an unknown kind"),
    ],
)
def test_what_is_no_result_is_refused(tmp_path: Path, data: bytes, problem: str):
    with pytest.raises(InputDataError, match=problem):
        load_trajectory(write(tmp_path, data))


def test_standard_input_takes_a_log_too(monkeypatch: pytest.MonkeyPatch):
    for data in (LOG.encode(), gzip.compress(LOG.encode())):
        monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(data)))
        np.testing.assert_allclose(load_trajectory("-").poses, [[1, 0, 0.5], [2, 0, 0.5]])
    log = "".join(line for line in LOG.splitlines(keepends=True) if line.startswith("FLASER"))
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(log.encode())))
    with pytest.raises(InputDataError, match=r"^standard input: the log has no true poses"):
        load_reference("-")


def test_records_that_were_skipped_are_told(tmp_path: Path):
    notices: list[str] = []
    load_trajectory(write(tmp_path, LOG.replace("2.0 3.0 2.0", "2.0 x 2.0").encode()), notices=notices)
    assert len(notices) == 1
    assert "1 record skipped: a value is not a number, first in line 3" in notices[0]


def test_what_a_truncated_file_still_has_can_be_measured(tmp_path: Path):
    """And what was lost is told; without --salvage it is an error."""
    rng = np.random.default_rng(7)
    poses = rng.uniform(-9, 9, (400, 3))
    tum = write_tum([str(k) for k in range(400)], poses)
    lines = [f"FLASER 1 1 {x} {y} 0 {x} {y} 0 {k}.5 h {k}.5\n" for k, (x, y, _) in enumerate(poses.tolist())]
    for content in (tum, "".join(lines).encode()):
        # The last line that is left may be cut, and is no whole one then.
        packed = gzip.compress(content, mtime=0)
        path = write(tmp_path, packed[: len(packed) // 2])
        with pytest.raises(InputDataError, match=r"the gzip data end too early; .*--salvage"):
            load_trajectory(path)
        notices: list[str] = []
        # The poses are random: now and then one looks like a single wrong value.
        found = load_trajectory(path, ReadingOptions(salvage=True, as_recorded=True), notices)
        assert 100 < len(found) < 300
        np.testing.assert_allclose(found.poses[:, :2], poses[: len(found), :2], atol=1e-8)
        assert any("the gzip data end too early: the rest is lost" in notice for notice in notices)


def test_a_missing_result_says_so(tmp_path: Path):
    with pytest.raises(InputMissingError, match="no such file"):
        load_trajectory(str(tmp_path / "a.json"))
