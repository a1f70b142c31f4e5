"""Byte-order marks: UTF-8's costs nothing in any text that is read, other encodings are named."""

from __future__ import annotations

import codecs

import pytest

from nscan_cli.errors import InputDataError
from nscan_cli.evaluation.reference_relations import read_relations
from nscan_cli.files.encoding import without_byte_order_mark
from nscan_cli.graph.io.load_graph import load_graph
from nscan_cli.logs.load import read_log
from tests.graph.small_graph import read_tum
from tests.logs.lines import flaser

LOGS = {
    "CARMEN": f"{flaser(1)}\n{flaser(2)}\n",
    "Player": "".join(
        f"106738197{k}.050 gates1 6665 laser 00 106738197{k}.050 -1.5708 +1.5708 +0.7854 0002 1.0  0 2.0  0\n"
        for k in range(2)
    ),
    ".script": "".join(f"LASER-RANGE {k} 5 0 2 180.0: 100 200\n" for k in range(2)),
}


@pytest.mark.parametrize("form", LOGS)
def test_no_scan_of_a_log_is_lost(form, tmp_path):
    path = tmp_path / "some.log"
    path.write_bytes(codecs.BOM_UTF8 + LOGS[form].encode())
    log = read_log(str(path))
    assert len(log) == 2
    assert log.report.skipped == {}
    assert log.source.bytes == len(LOGS[form]) + 3


def test_no_line_of_another_text_is_lost(tmp_path):
    def marked(text: str) -> str:
        path = tmp_path / "text"
        path.write_bytes(codecs.BOM_UTF8 + text.encode())
        return str(path)

    assert read_tum(marked("1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n")).stamps == ("1", "2")
    assert len(read_relations(marked("1 2 1 0 0 0 0 0\n2 3 1 0 0 0 0 0\n")).stamps) == 2
    g2o = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n"
    assert len(load_graph(marked(g2o)).poses) == 2


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_other_encodings_are_named(encoding, tmp_path):
    path = tmp_path / "some.log"
    path.write_bytes(LOGS["CARMEN"].encode(encoding))
    for read in (read_log, read_tum, load_graph):
        with pytest.raises(InputDataError, match=r"some\.log: is text in UTF-16 or UTF-32; save it as UTF-8"):
            read(str(path))


@pytest.mark.parametrize("data", [b"", b"FLASER 1", bytes(64), b"\x89MCAP0\r\n", b"a\0b", bytes(range(256))])
def test_other_bytes_stay_as_they_are(data):
    assert without_byte_order_mark(data, "x") == data
