"""What is lost with lines of a g2o file that are not read is said."""

from __future__ import annotations

from pathlib import Path

import pytest

from nscan_cli.errors import InputDataError
from nscan_cli.graph.io.g2o import loss_messages, parse_g2o
from nscan_cli.graph.io.load_graph import load_graph

POSES = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n"


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("VERTEX_XY 5000 1 2\nEDGE_SE2_XY 0 5000 1 2 10 0 10\nEDGE_SE2_XY 1 5000 0 2 10 0 10\n", [
            "2 EDGE_SE2_XY lines skipped: observations of landmarks are not read",
            "1 VERTEX_XY line skipped: landmarks are not read",
        ]),
        ("EDGE_BEARING_SE2_XY 0 7 0.5 10\nLANDMARK 0 7 1 1 1 0 1\n", [
            "1 EDGE_BEARING_SE2_XY line and 1 LANDMARK line skipped: observations of landmarks",
        ]),
        ("EDGE_PRIOR_SE2 0 0 0 0 9 0 0 9 0 9\nEDGE_PRIOR_SE2_XY 0 0 0 9 0 9\nEDGE_GPS 0 1 2 3\n", [
            "1 EDGE_GPS line, 1 EDGE_PRIOR_SE2 line and 1 EDGE_PRIOR_SE2_XY line skipped: priors on poses "
            "are not read, so the graph's frame is free",
        ]),
        ("EDGE_SE2_MIXTURE 0 1 2 EDGE_SE2 0.9 0 1 1 0 0 1 0 0 1 0 1\nEDGE_SE2_MAXMIX 0 1 0.1 1 0 0\n", [
            "1 EDGE_SE2_MAXMIX line and 1 EDGE_SE2_MIXTURE line skipped: edges with several alternatives",
        ]),
        ("VERTEX_SWITCH 9 1\nEDGE_SWITCH_PRIOR 9 1 1\nEDGE_SE2_SWITCHABLE 0 1 9 1 0 0 1 0 0 1 0 1\n", [
            "1 EDGE_SE2_SWITCHABLE line, 1 EDGE_SWITCH_PRIOR line and 1 VERTEX_SWITCH line skipped: edges "
            "that can be switched off are not read, so these loops are not closed",
        ]),
        ("PARAMS_SE2OFFSET 3 0 0 0\nEDGE_SE2_OFFSET 0 1 3 3 1 0 0 1 0 0 1 0 1\n", [
            "1 EDGE_SE2_OFFSET line and 1 PARAMS_SE2OFFSET line skipped: offsets and calibrations of sensors",
        ]),
        ("VERTEX3 8 0 0 0 0 0 0\n", ["1 VERTEX3 line skipped: of graphs in space only planar"]),
        ("EDGE_SE2_ROBUST 0 1 1 0 0 1 0 0 1 0 1\n", [
            "1 EDGE_SE2_ROBUST line skipped: edges with robust kernels",
        ]),
        ("EDGE_NEW 0 1 1\nVERTEX_NEW 8 1\n", [
            "1 EDGE_NEW line skipped: edges of this kind are not read",
            "1 VERTEX_NEW line skipped: vertices of this kind are not read",
        ]),
        ("ROBOTLASER1 0 1 2\nhello world\n\x1b[31m 1\n", [
            "1 ROBOTLASER1 line skipped: what sensors saw",
            "1 '\\x1b[31m' line and 1 hello line skipped: this tag is not known",
        ]),
        ("".join(f"TAG{k:02} 1\n" for k in range(9)) * 2, [
            "2 TAG00 lines, 2 TAG01 lines, 2 TAG02 lines, 2 TAG03 lines, 2 TAG04 lines and lines of 4 other "
            "tags skipped: ",
        ]),
        ("FIX 0\n", []),
    ],
)  # fmt: skip
def test_each_kind_of_line_is_counted_with_what_is_lost(tmp_path: Path, lines: str, said: list[str]):
    path = tmp_path / "graph.g2o"
    path.write_text(POSES + lines)
    notices: list[str] = []
    graph = load_graph(str(path), notices)
    assert len(graph.pairwise) == 1
    assert len(notices) == len(said)
    for each in said:
        assert any(notice.startswith(f"{path}: {each}") for notice in notices)
    assert sum(graph.provenance["skipped"].values()) == lines.count("\n") - lines.count("FIX")


def test_a_fixed_landmark_fixes_no_pose():
    lines = "FIX 1\nVERTEX_XY 5000 1 2\nFIX 5000\n"
    assert len(parse_g2o((POSES + lines).encode(), "graph.g2o")) == 2
    with pytest.raises(InputDataError, match="line 5: there is no vertex 5000"):
        parse_g2o((POSES + "VERTEX_XY 4000 1 2\nFIX 5000\n").encode(), "graph.g2o")


def test_a_file_with_none_of_the_plane_says_what_it_has():
    with pytest.raises(
        InputDataError, match=r"no VERTEX_SE2 or EDGE_SE2 line; 2 VERTEX3 lines skipped: of graphs"
    ):
        parse_g2o(b"VERTEX3 1 0 0 0 0 0 0\nVERTEX3 2 0 0 0 0 0 0\n", "graph.g2o")


def test_there_is_a_sentence_for_whatever_a_tag_is():
    assert loss_messages({"": 1}) != []
    assert loss_messages({}) == []
