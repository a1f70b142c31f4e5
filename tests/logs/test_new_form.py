"""A form of log is added by a module that reads it and a line in logs.kinds.FORMS; nothing else changes."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

from nscan_cli.cli.main import run
from nscan_cli.logs import formats
from nscan_cli.logs.formats import Form, readable_forms
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from tests.logs import csv_form
from tests.logs.lines import flaser

LINES = "".join(f"{k / 5},{0.1 * k},0,0,2.0,{3 - 0.1 * k:.1f},2.0\n" for k in range(5))
CSV = csv_form.HEAD + LINES.encode()


@pytest.fixture
def with_csv(monkeypatch: pytest.MonkeyPatch) -> None:
    form = Form("CSV", "tests.logs.csv_form")
    monkeypatch.setattr("nscan_cli.logs.load.FORMS", (*formats.FORMS, form))
    monkeypatch.setattr(formats, "FORMS", (*formats.FORMS, form))


def test_a_new_form_is_read_plain_and_packed_with_all_reading_options(with_csv, tmp_path):
    path = tmp_path / "log"
    for data in (CSV, gzip.compress(CSV)):
        path.write_bytes(data)
        log = read_log(str(path), ReadingOptions(every=2, max_range=2.7))
        assert (log.format, log.numbers.tolist()) == ("CSV", [0, 2, 4])
        np.testing.assert_allclose(log.ranges[0], [2, np.inf, 2])
        assert log.odometry is not None
        np.testing.assert_allclose(log.odometry[:, 0], [0, 0.2, 0.4])
        np.testing.assert_allclose(log.points(2)[1], [2.6, 0], atol=1e-6)


def test_the_commands_take_it_and_their_messages_name_it(with_csv, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log.csv").write_bytes(CSV + b"1.0,broken\n")
    assert run(["info", "log.csv"]) == 0
    out = capsys.readouterr().out
    assert "format         CSV\n" in out
    assert "1 record: a value is not a number, first in line 7" in out
    assert run(["info", "log.csv", "--strict"]) == 65
    assert "log.csv, line 7: a value is not a number" in capsys.readouterr().err
    (tmp_path / "letter").write_text("Dear all,\n")
    assert run(["info", "letter"]) == 65
    assert "give a log: MCAP, " in (said := capsys.readouterr().err)
    assert ", CSV; plain or packed by gzip" in said
    assert readable_forms().partition(";")[0].count(",") == len(formats.FORMS) - 1


def test_it_takes_nothing_from_the_others(with_csv, tmp_path):
    (tmp_path / "log").write_text(flaser(1.0) + "\n")
    assert read_log(str(tmp_path / "log")).format == "CARMEN"
