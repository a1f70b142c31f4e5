"""Our TUM trajectories read by evo (https://github.com/MichaelGrupp/evo)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nscan_cli.graph.io.tum import write_tum
from nscan_cli.poses import relative
from tests.graph.small_graph import read_tum

file_interface = pytest.importorskip(
    "evo.tools.file_interface", reason="evo is not installed: pip install nscan-cli[test]"
)


def test_evo_reads_stamps_positions_and_angles(tmp_path: Path):
    rng = np.random.default_rng(7)
    poses = rng.uniform([-100, -100, -np.pi], [100, 100, np.pi], size=(50, 3))
    poses[:3, 2] = [np.pi, -np.pi / 2, 0.0]
    stamps = [f"{976052896 + 0.2 * k:.6f}" for k in range(50)]
    path = tmp_path / "path.tum"
    path.write_bytes(write_tum(stamps, poses))
    trajectory = file_interface.read_tum_trajectory_file(str(path))
    valid, details = trajectory.check()
    assert valid, details
    np.testing.assert_array_equal(trajectory.timestamps, [float(stamp) for stamp in stamps])
    matrices = np.array(trajectory.poses_se3)
    found = np.column_stack([matrices[:, :2, 3], np.arctan2(matrices[:, 1, 0], matrices[:, 0, 0])])
    np.testing.assert_allclose(relative(found, poses), 0, atol=5e-9)
    np.testing.assert_array_equal(matrices[:, 2, 3], 0)


def test_what_evo_writes_we_read(tmp_path: Path):
    poses = np.array([[1.0, -2.0, 0.5], [3.0, 0.25, -3.0]])
    path = tmp_path / "ours.tum"
    path.write_bytes(write_tum(["10.5", "11"], poses))
    trajectory = file_interface.read_tum_trajectory_file(str(path))
    file_interface.write_tum_trajectory_file(str(tmp_path / "evo.tum"), trajectory)
    back = read_tum(str(tmp_path / "evo.tum"))
    np.testing.assert_allclose(back.times, [10.5, 11])
    np.testing.assert_allclose(relative(back.poses, poses), 0, atol=5e-9)
