"""The sample logs in the repository are what the simulator makes."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest

from tests.simulation.make_samples import main, samples

FOLDER = Path(__file__).resolve().parents[2] / "sample_logs"


@pytest.fixture(scope="module")
def made() -> dict[str, bytes]:
    return samples()


@pytest.mark.parametrize("name", ["office.log", "corridor_and_room.log"])
def test_regenerated_samples_are_those_committed(made, name):
    committed = (FOLDER / f"{name}.gz").read_bytes()
    # The text is compared: another version of zlib may pack it otherwise.
    assert gzip.decompress(committed) == made[name]
    assert committed[4:8] == bytes(4), "the header holds a time"
    assert len(committed) < 1_000_000


def test_written_twice_the_bytes_are_the_same(tmp_path, monkeypatch, made):
    monkeypatch.setattr("tests.simulation.make_samples.samples", lambda: made)
    written = []
    for _ in range(2):
        main(str(tmp_path))
        written.append({path.name: path.read_bytes() for path in sorted(tmp_path.iterdir())})
    assert written[0] == written[1]
    assert list(written[0]) == ["corridor_and_room.log.gz", "office.log.gz"]
