"""The sample logs in the repository are what the simulator makes."""

from __future__ import annotations

import gzip
import io

import numpy as np
import pytest
from mcap.reader import make_reader

from nscan_cli.logs.load import read_log
from tests.data import CORRIDOR_LOG, SAMPLE_LOGS
from tests.simulation.make_samples import main, samples


@pytest.fixture(scope="module")
def made() -> dict[str, bytes]:
    return samples()


@pytest.mark.parametrize("name", ["office.log", "corridor_and_room.log", "corridor_and_room.player.log"])
def test_regenerated_samples_are_those_committed(made, name):
    committed = (SAMPLE_LOGS / f"{name}.gz").read_bytes()
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
    assert list(written[0]) == [
        "corridor_and_room.log.gz",
        "corridor_and_room.mcap",
        "corridor_and_room.player.log.gz",
        "office.log.gz",
        "turning_laser.mcap",
    ]


@pytest.mark.parametrize("name", ["corridor_and_room.mcap", "turning_laser.mcap"])
def test_the_recording_holds_the_messages_that_are_made_again(made, name):
    committed = (SAMPLE_LOGS / name).read_bytes()
    assert len(committed) < 150_000

    def messages(data: bytes) -> list[tuple[str, str, int, bytes]]:
        reader = make_reader(io.BytesIO(data), validate_crcs=True)
        # What is inside is compared: another version of zstd may pack it otherwise.
        return [
            (channel.topic, schema.name if schema else "", message.log_time, message.data)
            for schema, channel, message in reader.iter_messages(log_time_order=False)
        ]

    assert messages(committed) == messages(made[name])


@pytest.mark.parametrize("name", ["corridor_and_room.player.log.gz", "corridor_and_room.mcap"])
def test_the_same_drive_in_another_form(name):
    carmen = read_log(CORRIDOR_LOG)
    other = read_log(str(SAMPLE_LOGS / name))
    np.testing.assert_array_equal(other.ranges, carmen.ranges)
    np.testing.assert_allclose(other.times, carmen.times, atol=1e-6)
    np.testing.assert_allclose(other.mount, carmen.mount, atol=1e-9)
    # Player prints poses in mm, angles in 0.1 mrad; MCAP has angles as float32.
    assert other.odometry is not None
    assert carmen.odometry is not None
    np.testing.assert_allclose(other.odometry, carmen.odometry, atol=5.1e-4)
    np.testing.assert_allclose(other.angle_min, carmen.angle_min, atol=5e-5)
    np.testing.assert_allclose(other.angle_increment, carmen.angle_increment, atol=1e-8)
    assert other.report.skipped == {}
    assert other.report.warnings == ()
