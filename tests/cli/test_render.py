from __future__ import annotations

import gzip
import hashlib
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from nscan_cli.cli.main import run
from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.graph.model import Graph, Pairwise
from tests.data import data_file
from tests.mapping.nav2 import load_map

POSES = np.array([[1.0, 2.0, 0.0], [2.0, 2.0, 0.5], [3.0, 2.0, 0.0], [4.0, 2.0, -0.5], [5.0, 2.0, 3.0]])
WIDTH, HEIGHT = 6.0, 4.0


def scan_of_the_room(pose: np.ndarray) -> np.ndarray:
    """181 beams, −90° to 90°, from a pose within the room from (0, 0) to (WIDTH, HEIGHT)."""
    angles = pose[2] + np.radians(np.arange(-90, 91))
    with np.errstate(divide="ignore"):
        to_x = np.where(np.cos(angles) > 0, WIDTH - pose[0], -pose[0]) / np.cos(angles)
        to_y = np.where(np.sin(angles) > 0, HEIGHT - pose[1], -pose[1]) / np.sin(angles)
    ranges: np.ndarray = np.minimum(to_x, to_y)
    return ranges


def log_text() -> bytes:
    lines = []
    for k, pose in enumerate(POSES):
        ranges = " ".join(f"{r:.3f}" for r in scan_of_the_room(pose))
        triple = " ".join(f"{value:.6f}" for value in pose)
        lines.append(f"FLASER 181 {ranges} {triple} {triple} {10 + k}.0 host {k}.0\n")
    return "".join(lines).encode()


def graph_of(log: bytes, **changes: Any) -> Graph:
    source = {"name": "room.log", "sha256": hashlib.sha256(log).hexdigest(), "bytes": len(log)}
    graph = Graph(
        scans=np.arange(len(POSES)),
        stamps=[f"{10 + k}.0" for k in range(len(POSES))],
        poses=POSES,
        odometry=None,
        anchors=np.arange(len(POSES)),
        pairwise=[Pairwise((0, 4), np.array([4.0, 0.0, 3.0]), np.eye(3), "loop")],
        marginals={4: np.eye(3) * 0.01},
        provenance={"inputs": [source], "parameters": {}},
    )
    for name, value in changes.items():
        setattr(graph, name, value)
    return graph


@pytest.fixture
def room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder, the current one, with room.log and its graph room.json."""
    log = log_text()
    (tmp_path / "room.log").write_bytes(log)
    (tmp_path / "room.json").write_bytes(write_graph(graph_of(log)))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def picture(path: Path) -> np.ndarray:
    pixels: np.ndarray = np.asarray(Image.open(path))
    return pixels


def test_the_map_is_the_room(room, capsys):
    assert run(["render", "room.json", "-o", "map.png"]) == 0
    gray = picture(room / "map.png")
    yaml = (room / "map.yaml").read_text()
    assert 'image: "map.png"\n' in yaml
    # Walls lie on x = 0 and 6, y = 0 and 4 (of cells, on either side); one cell is to spare around.
    assert gray.shape[0] == pytest.approx(HEIGHT / 0.05 + 3, abs=1)
    assert gray.shape[1] == pytest.approx(WIDTH / 0.05 + 3, abs=1)
    black = np.argwhere(gray == 0)
    assert len(black) > 200
    to_border = np.minimum(black, np.array(gray.shape) - 1 - black).min(axis=1)
    assert to_border.max() <= 3
    assert not (gray[10:-10, 10:-10] == 0).any()
    assert (gray[10:-10, 10:-10] == 254).mean() > 0.95
    assert (gray[[0, -1]] == 205).all()
    assert "map.png and map.yaml: 6.2 m × 4.2 m from 5 scans" in capsys.readouterr().err


def test_nav2_finds_the_walls_where_they_are(room):
    assert run(["render", "room.json", "-o", "map.png"]) == 0
    loaded = load_map(room / "map.yaml")
    # The walls are on the borders of cells: rounding to mm decides which side a hit is on. A single scan
    # sees the wall at x = 0, too thinly for walls.
    along, sides = np.arange(1.0, 3.0, 0.05), (-0.03, 0.03)
    assert 100 in [loaded.at(WIDTH + side, y) for y in along for side in sides]
    for wall in (0.0, HEIGHT):
        assert 100 in [loaded.at(1.5 + x, wall + side) for x in along for side in sides]
    assert [loaded.at(x, y) for x, y in ((0.5, 0.5), (5.5, 0.5), (5.5, 3.5), (3.0, 2.0))] == [0] * 4
    assert loaded.at(loaded.origin[0] + 0.01, loaded.origin[1] + 0.01) == -1


def test_the_log_is_found_beside_the_graph_then_here(room, monkeypatch, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    monkeypatch.chdir(elsewhere)
    assert run(["render", str(room / "room.json"), "-o", "map.png"]) == 0
    (room / "room.log").rename(elsewhere / "room.log")
    assert run(["render", str(room / "room.json"), "-o", "again.png"]) == 0
    assert (elsewhere / "map.png").read_bytes() == (elsewhere / "again.png").read_bytes()


def test_a_log_that_is_nowhere_is_named(room, capsys):
    (room / "room.log").unlink()
    assert run(["render", "room.json", "-o", "map.png"]) == 66
    error = capsys.readouterr().err
    assert (
        "room.json: its log room.log is neither beside it nor in the current folder; give its path as LOG"
        in error
    )
    assert not list(room.glob("map*"))


def test_a_graph_without_provenance_needs_a_log(room, capsys):
    (room / "room.json").write_bytes(write_graph(graph_of(b"", provenance={})))
    assert run(["render", "room.json", "-o", "map.png"]) == 66
    assert "does not name its log; give its path as LOG" in capsys.readouterr().err
    assert run(["render", "room.json", "room.log", "-o", "map.png"]) == 0


@pytest.mark.parametrize("explicit", [True, False])
def test_another_log_of_the_same_name_is_refused(room, capsys, explicit):
    (room / "room.log").write_bytes(log_text() + b"# changed\n")
    arguments = ["room.log"] if explicit else []
    assert run(["render", "room.json", *arguments, "-o", "map.png"]) == 65
    error = capsys.readouterr().err
    assert "room.log: is not the log of room.json: its SHA-256 differs" in error
    assert error.count("\n") == 1
    assert not list(room.glob("map*"))


def test_a_graph_with_scans_that_the_log_does_not_have_is_refused(room, capsys):
    (room / "room.json").write_bytes(write_graph(graph_of(log_text(), scans=np.array([0, 1, 2, 3, 7]))))
    assert run(["render", "room.json", "-o", "map.png"]) == 65
    assert "room.log: has no scan 7, which room.json has; give the log" in capsys.readouterr().err


def test_the_sha256_is_of_the_stored_bytes(room):
    packed = gzip.compress(log_text(), mtime=0)
    (room / "room.log").write_bytes(packed)
    (room / "room.json").write_bytes(write_graph(graph_of(packed)))
    assert run(["render", "room.json", "-o", "map.png"]) == 0


def test_the_log_may_come_from_standard_input(room, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(log_text())))
    assert run(["render", "room.json", "-", "-o", "map.png"]) == 0


def test_both_inputs_from_standard_input_are_refused(room, capsys):
    assert run(["render", "-", "-", "-o", "map.png"]) == 2
    assert "standard input" in capsys.readouterr().err


def test_left_out_scans_are_not_drawn(room, capsys):
    assert run(["render", "room.json", "-o", "map.png", "--every", "2"]) == 0
    assert "from 3 scans" in capsys.readouterr().err


def test_the_log_is_read_as_slam_has_read_it(room, capsys):
    """The graph's poses are of a robot 1 m behind the laser; without its mount, the map moves by that."""
    origin = {}
    for name, parameters, options in (
        ("plain", {}, []),
        ("tracked", {"reading": {"mount": [1.0, 0.0, 0.0], "every": 1}}, []),
        ("overridden", {"reading": {"mount": [1.0, 0.0, 0.0], "every": 1}}, ["--mount", "2,0,0"]),
    ):
        poses = POSES * [1, 1, 0]
        graph = graph_of(log_text(), poses=poses)
        graph.provenance["parameters"] = parameters
        (room / "room.json").write_bytes(write_graph(graph))
        assert run(["render", "room.json", "-o", f"{name}.png", *options]) == 0
        line = (room / f"{name}.yaml").read_text().splitlines()[3]
        origin[name] = float(line.removeprefix("origin: [").split(",")[0])
    assert origin["tracked"] - origin["plain"] == pytest.approx(1.0, abs=0.051)
    assert origin["overridden"] - origin["plain"] == pytest.approx(2.0, abs=0.051)


@pytest.mark.parametrize("sector", [[0.5, -0.5], [0.5, -0.5, 100.0]])
def test_the_mask_of_slam_holds(room, sector):
    """Without a beam the map is that of no scan."""
    (room / "room.json").write_bytes(write_graph(graph_of(log_text())))
    assert run(["render", "room.json", "-o", "all.png", "--no-yaml"]) == 0
    graph = graph_of(log_text())
    graph.provenance["parameters"] = {"reading": {"mask": [sector]}}
    (room / "room.json").write_bytes(write_graph(graph))
    assert run(["render", "room.json", "-o", "part.png", "--no-yaml"]) == 0
    whole, part = (np.count_nonzero(picture(room / name) == 0) for name in ("all.png", "part.png"))
    assert part < 0.8 * whole


@pytest.mark.parametrize("options", [["--trajectory"], ["--graph"], ["--uncertainty"], ["--style", "paper"]])
def test_pictures_in_colour_have_no_yaml(room, options):
    assert run(["render", "room.json", "-o", "map.png", *options]) == 0
    pixels = picture(room / "map.png").astype(int)
    assert pixels.shape[2] == 3
    assert (np.ptp(pixels, axis=-1) > 60).sum() > 50
    assert not (room / "map.yaml").exists()
    assert run(["render", "room.json", "-o", "other.png", "--yaml", *options]) == 2
    assert not (room / "other.png").exists()


def test_a_graph_without_covariances_says_so(room, capsys):
    (room / "room.json").write_bytes(write_graph(graph_of(log_text(), marginals={})))
    assert run(["render", "room.json", "-o", "map.png", "--uncertainty"]) == 0
    assert "has no covariances" in capsys.readouterr().err


def test_no_yaml_writes_none(room):
    assert run(["render", "room.json", "-o", "map.png", "--no-yaml"]) == 0
    assert not (room / "map.yaml").exists()


def test_standard_output_gets_the_png_alone(room, capsysbinary):
    assert run(["render", "room.json", "-o", "-"]) == 0
    out, err = capsysbinary.readouterr()
    assert err == b""
    assert run(["render", "room.json", "-o", "map.png"]) == 0
    assert out == (room / "map.png").read_bytes()


@pytest.mark.parametrize(
    ("output", "code"), [("missing/map.png", 73), (".", 73), ("map.yaml", 2), ("map.png/x.png", 73)]
)
def test_outputs_that_cannot_be_are_refused_first(room, output, code, capsys):
    (room / "map.png").write_bytes(b"old")
    assert run(["render", "absent.json", "-o", output]) == code
    assert capsys.readouterr().err.count("\n") == 1


def test_finer_cells_make_a_larger_picture(room):
    assert run(["render", "room.json", "-o", "map.png", "--resolution", "0.02"]) == 0
    assert picture(room / "map.png").shape[1] == pytest.approx(WIDTH / 0.02 + 3, abs=1)
    assert "resolution: 0.02\n" in (room / "map.yaml").read_text()


def test_a_real_log_and_its_reference_poses_give_a_map(tmp_path):
    """fr-campus: buildings, and much free ground between them."""
    log = data_file("fr-campus.log.gz")
    table = np.loadtxt(data_file("fr-campus.reference.tum"))
    poses = np.column_stack([table[:, 1:3], 2 * np.arctan2(table[:, 6], table[:, 7])])
    nodes = np.arange(len(poses))
    sha256 = hashlib.sha256(log.read_bytes()).hexdigest()
    source = {"name": log.name, "sha256": sha256, "bytes": log.stat().st_size}
    graph = Graph(nodes, [f"{t:.6f}" for t in table[:, 0]], poses, None, nodes,
                  provenance={"inputs": [source], "parameters": {}})  # fmt: skip
    (tmp_path / "campus.json").write_bytes(write_graph(graph))
    output = tmp_path / "campus.png"
    assert (
        run(["render", str(tmp_path / "campus.json"), str(log), "-o", str(output), "--resolution", "0.1"])
        == 0
    )
    gray = picture(output)
    shares = {shade: np.count_nonzero(gray == shade) / gray.size for shade in (0, 205, 254)}
    assert sum(shares.values()) == 1
    assert shares[254] > 0.3
    assert 0.001 < shares[0] < 0.02
