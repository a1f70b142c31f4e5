"""`nscan-cli render` with --align, --crop and --clean: the map as it is handed over."""

from __future__ import annotations

import json
import math
import re

import numpy as np
import pytest

from nscan_cli.cli.main import run
from nscan_cli.graph.io.json_graph import write_graph
from nscan_cli.graph.model import turned_graph
from tests.cli.test_render import POSES, graph_of, log_text, picture, room
from tests.graph.small_graph import read_tum
from tests.mapping.nav2 import load_map

__all__ = ["room"]
TURN = math.radians(25)


@pytest.fixture
def slanting(room):
    """The room of test_render, turned by 25°."""
    (room / "room.json").write_bytes(write_graph(turned_graph(graph_of(log_text()), TURN)))
    return room


def test_an_aligned_map_is_that_of_the_graph_turned_back(slanting, capsys):
    arguments = ["render", "room.json", "-o", "map.png", "--align", "--poses", "path.tum", "--json"]
    assert run(arguments) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["turned"] == pytest.approx(-25, abs=0.3)
    assert facts["removed"] is None
    gray = picture(slanting / "map.png")
    assert gray.shape == (facts["height"], facts["width"])
    # 6 m × 4 m of a room along the axes; slanting, it is 7.1 m × 6.2 m.
    assert gray.shape == (pytest.approx(4 / 0.05, abs=6), pytest.approx(6 / 0.05, abs=6))
    turned = read_tum(slanting / "path.tum").poses
    assert turned == pytest.approx(POSES, abs=0.03)
    # The YAML says how poses of the graph get there.
    yaml = (slanting / "map.yaml").read_text()
    numbers = re.search(r"# \((\S+) x (\S+) y, (\S+) x (\S+) y, a (\S+)\)", yaml)
    assert numbers
    xx, xy, yx, yy, turn = map(float, numbers.groups())
    graph = turned_graph(graph_of(log_text()), TURN).poses
    assert turned[:, :2] == pytest.approx(graph[:, :2] @ np.array([[xx, xy], [yx, yy]]).T, abs=1e-6)
    assert math.degrees(turn) == pytest.approx(facts["turned"], abs=1e-5)
    assert load_map(slanting / "map.yaml").at(3.0, 2.0) == 0


def test_a_cut_map_lies_where_it_lay(room, capsys):
    assert run(["render", "room.json", "-o", "whole.png"]) == 0
    assert run(["render", "room.json", "-o", "part.png", "--crop", "2,1,5,4.1", "--json"]) == 0
    whole, part = (load_map(room / f"{name}.yaml") for name in ("whole", "part"))
    assert json.loads(capsys.readouterr().out)["bounds"] == [2.0, 1.0, 5.0, 4.1]
    assert part.data.shape == (62, 60)
    for x in np.arange(2.02, 5.0, 0.1):
        for y in np.arange(1.02, 4.1, 0.1):
            assert part.at(x, y) == whole.at(x, y)


def test_a_cut_by_itself_leaves_half_a_metre(room, capsys):
    """The wall on the left has been hit once only: it is none, so the first pose is the leftmost thing."""
    assert run(["render", "room.json", "-o", "part.png", "--crop", "auto", "--json"]) == 0
    bounds = json.loads(capsys.readouterr().out)["bounds"]
    assert bounds[0] == pytest.approx(0.5, abs=0.051)
    # On the other sides the map itself ends before.
    assert bounds[2] == pytest.approx(6.1, abs=0.051)


def test_cleaning_says_and_draws_what_it_removes(room, capsys):
    assert run(["render", "room.json", "-o", "map.png", "--clean", "--removed", "gone.png", "--json"]) == 0
    removed = json.loads(capsys.readouterr().out)["removed"]
    assert set(removed) == {"gone", "specks", "unconnected"}
    assert picture(room / "gone.png").shape[2] == 3
    assert run(["render", "room.json", "-o", "plain.png"]) == 0
    changed = np.count_nonzero(picture(room / "map.png") != picture(room / "plain.png"))
    assert changed == sum(removed.values())


def test_all_outputs_are_of_the_shaped_map(slanting):
    assert run(["render", "room.json", "-o", "a.html", "--align", "--clean", "--crop", "auto"]) == 0
    assert run(["render", "room.json", "-o", "b.png", "--align", "--graph", "--uncertainty"]) == 0
    assert run(["render", "room.json", "-o", "c.png", "--align", "--style", "paper"]) == 0
    pixels = picture(slanting / "c.png")
    assert pixels.shape[1] > 1.15 * pixels.shape[0]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--crop", "1,2,3"], "'1,2,3' is not of the form X0,Y0,X1,Y1, as in -10,-5,30,25, nor auto"),
        (["--crop", "5,2,3,4"], "is not a lower left corner before an upper right one"),
        (["--crop", "100,100,200,200"], "--crop: leaves nothing of the map"),
        (["--removed", "gone.png"], "--removed draws what --clean removes; give --clean, too"),
        (["--clean", "--removed", "map.png"], "--removed map.png: is another file of this command"),
        (["--clean", "--removed", "gone.svg"], "pictures are PNG; name it like gone.png"),
        (["--poses", "map.yaml"], "--poses map.yaml: is another file of this command"),
        (["--poses", "a.tum", "--mcap", "a.tum"], "--poses a.tum: is another file of this command"),
    ],
)
def test_what_cannot_be_is_refused(room, capsys, arguments, said):
    assert run(["render", "room.json", "-o", "map.png", *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not (room / "map.png").exists()


def test_json_needs_the_map_in_a_file(room, capsys):
    assert run(["render", "room.json", "-o", "-", "--json"]) == 2
    assert "--json prints to standard output; give -o MAP.png, too" in capsys.readouterr().err
