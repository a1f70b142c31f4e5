from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from nscan_cli.errors import InputDataError, InputMissingError
from nscan_cli.evaluation.results import load_reference, load_trajectory
from nscan_cli.graph.json_file import write_graph
from nscan_cli.graph.tum import write_tum
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


def test_a_missing_result_says_so(tmp_path: Path):
    with pytest.raises(InputMissingError, match="no such file"):
        load_trajectory(str(tmp_path / "a.json"))
