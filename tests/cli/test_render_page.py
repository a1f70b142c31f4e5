"""`nscan-cli render -o MAP.html`: the page of a map."""

from __future__ import annotations

import re

import numpy as np
import pytest

from nscan_cli.cli.main import run
from tests.cli.test_render import POSES, room, scan_of_the_room
from tests.mapping.viewer.unpack import block_of, ranges_of, unpack

__all__ = ["room"]


def test_the_page_is_one_file_with_path_and_scans(room, capsys):
    assert run(["render", "room.json", "-o", "map.html"]) == 0
    assert sorted(path.name for path in room.iterdir()) == ["map.html", "room.json", "room.log"]
    assert "map.html: 6.2 m × 4.2 m from 5 scans" in capsys.readouterr().err
    page = (room / "map.html").read_text()
    assert "<title>map</title>" in page
    assert set(re.findall(r'(?:src|href)="([^",]*)', page)) <= {"data:", "data:image/png;base64"}
    assert not re.search(r"@import|url\(|https?:", page)
    data = unpack(block_of(page))
    assert data["poses"].reshape(-1, 3) == pytest.approx(POSES)
    expected = np.array([scan_of_the_room(pose) for pose in POSES])
    assert ranges_of(data) == pytest.approx(np.where(np.isfinite(expected), expected, 0.0), abs=0.006)
    assert data["facts"][0] == ["log", "room.log"]


def test_the_page_goes_with_a_recording_and_is_the_same_again(room):
    pytest.importorskip("mcap", reason="mcap is not installed")
    assert run(["render", "room.json", "-o", "a.html", "--mcap", "a.mcap", "-q"]) == 0
    first = (room / "a.html").read_bytes()
    assert (room / "a.mcap").stat().st_size > 1000
    assert run(["render", "room.json", "-o", "a.html", "-q"]) == 0
    assert (room / "a.html").read_bytes() == first


@pytest.mark.parametrize("more", [["--yaml"], ["--graph"], ["--trajectory"], ["--style", "paper"]])
def test_options_of_pictures_are_refused(room, capsys, more):
    assert run(["render", "room.json", "-o", "map.html", *more]) == 2
    assert "map.html: a page shows all of the graph" in capsys.readouterr().err
    assert not (room / "map.html").exists()


def test_other_commands_write_no_pages(room, capsys):
    assert run(["slam", "room.log", "-o", "a.json", "--map", "map.html"]) == 2
    assert "map.html: maps are PNG or PGM; name it like map.png" in capsys.readouterr().err
