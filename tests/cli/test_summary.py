from __future__ import annotations

from nscan_cli.cli.summary import summary_table


def test_titles_stand_once_and_rows_without_lines_not_at_all():
    rows = [("scans", ["2 of 3"]), ("left out", []), ("weak", ["scan 1", "scan 2"])]
    assert summary_table(rows) == "scans  2 of 3\nweak   scan 1\n       scan 2"


def test_lines_are_broken_at_80_columns_but_no_word_is():
    name = "a-name-of-a-file-" + "x" * 90
    shown = summary_table([("warning", ["word " * 30]), ("file", [name])])
    *words, last = shown.splitlines()
    assert max(map(len, words)) <= 80
    assert all(line.startswith(" " * 9) for line in words[1:])
    assert shown.count("word") == 30
    assert last == f"file     {name}"
