"""Two runs of the benchmarks compared."""

from __future__ import annotations

from tests.benchmarks.compare import WORSE, worse


def test_what_grew_by_more_than_the_share_is_told():
    before = {"read": {"ratio": 10.0}, "match": {"ratio": 2.0}, "gone": {"ratio": 1.0}}
    now = {"read": {"ratio": 12.1}, "match": {"ratio": 2.3}, "new": {"ratio": 9.0}}
    assert worse(now, before, WORSE) == [
        "read: time, measured by the workload's grew by 21%, from 10 to 12.1"
    ]
    assert len(worse(now, before, 0.1)) == 2


def test_memory_counts_too():
    before = {"slam": {"ratio": 10.0, "megabytes": 200.0}}
    now = {"slam": {"ratio": 5.0, "megabytes": 250.0}}
    (line,) = worse(now, before, WORSE)
    assert "memory" in line
    assert worse(now, {"slam": {"ratio": 10.0}}, WORSE) == []
