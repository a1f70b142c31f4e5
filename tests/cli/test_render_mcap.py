"""`nscan-cli render --mcap`: a recording beside the map."""

from __future__ import annotations

import io

import pytest

from nscan_cli.cli.main import run
from tests.cli.test_render import log_text, room

__all__ = ["room"]


def test_the_mcap_has_map_path_graph_and_scans(room):
    """tests/exports/test_mcap.py looks into it."""
    reader = pytest.importorskip("mcap.reader", reason="mcap is not installed: pip install nscan-cli[test]")
    assert run(["render", "room.json", "-o", "map.png", "--mcap", "out.mcap", "--every", "2"]) == 0
    data = (room / "out.mcap").read_bytes()
    summary = reader.make_reader(io.BytesIO(data), validate_crcs=True).get_summary()
    counts = {
        channel.topic: summary.statistics.channel_message_counts[number]
        for number, channel in summary.channels.items()
    }
    assert counts == {"/map": 1, "/path": 1, "/graph": 1, "/tf_static": 1, "/tf": 3, "/scan": 3}
    assert run(["render", "room.json", "-o", "map.png", "--mcap", "again.mcap", "--every", "2"]) == 0
    assert (room / "again.mcap").read_bytes() == data


@pytest.mark.parametrize(
    ("mcap", "code", "said"),
    [
        ("-", 2, "--mcap -: only the result can go to standard output"),
        ("missing/out.mcap", 73, "missing/out.mcap: the folder missing does not exist"),
        ("map.png", 2, "--mcap map.png: is another file of this command"),
        ("map.yaml", 2, "--mcap map.yaml: is another file of this command"),
        ("room.json", 2, "--mcap room.json: is another file of this command"),
        ("room.log", 2, "--mcap room.log: is another file of this command"),
    ],
)
def test_an_mcap_that_cannot_be_is_refused_before_the_work(room, capsys, mcap, code, said):
    before = sorted(path.name for path in room.iterdir())
    assert run(["render", "room.json", "room.log", "-o", "map.png", "--mcap", mcap]) == code
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert sorted(path.name for path in room.iterdir()) == before


def test_an_mcap_never_replaces_the_log_that_was_found(room, capsys):
    assert run(["render", "room.json", "-o", "map.png", "--mcap", "room.log"]) == 2
    assert "--mcap room.log: is another file of this command" in capsys.readouterr().err
    assert (room / "room.log").read_bytes() == log_text()
    assert not list(room.glob("map*"))
