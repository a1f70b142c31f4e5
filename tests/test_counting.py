"""One of a thing is named as one."""

from __future__ import annotations

import pytest

from nscan_cli.counting import counted


@pytest.mark.parametrize(
    ("count", "thing", "said"),
    [
        (0, "scan", "0 scans"),
        (1, "scan", "1 scan"),
        (2, "scan", "2 scans"),
        (1, "search", "1 search"),
        (13631, "search", "13631 searches"),
        (2, "time stamp", "2 time stamps"),
    ],
)
def test_counted(count, thing, said):
    assert counted(count, thing) == said
