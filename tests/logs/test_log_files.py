"""Logs of several files: folders that a recorder has left, split recordings, and what is neither."""

from __future__ import annotations

import hashlib
import random
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from nscan_cli.errors import InputDataError, InputMissingError, WrongUsageError
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.load import read_log
from nscan_cli.logs.log_files import files_of
from nscan_cli.logs.reading_options import ReadingOptions
from tests.logs.lines import flaser
from tests.logs.recordings.messages import S, Written, check_drive, drive
from tests.logs.recordings.ros import bag1, bag2, ros2, split_bag2

LATER = 3600 * S


def check_with(log: LaserLog, *said: str) -> None:
    """The log is that of drive(), and these are its only warnings, or the ends of them."""
    assert len(log.report.warnings) == len(said)
    for warning, end in zip(log.report.warnings, said, strict=True):
        assert warning.endswith(end)
    check_drive(replace(log, report=replace(log.report, warnings=())))


@pytest.fixture(params=["MCAP", "SQLITE3"])
def split(request, tmp_path) -> Path:
    """A folder with a recording in three files; the first alone has /tf_static."""
    return split_bag2(drive(), tmp_path / "my_bag", request.param)


def test_a_folder_of_one_file(tmp_path):
    folder = bag2(drive(), tmp_path / "my_bag", "SQLITE3")
    log = read_log(str(folder))
    check_drive(log)
    assert log.source.name == "my_bag.db3"
    (folder / "metadata.yaml").unlink()
    check_drive(read_log(f"{folder}/"))


def test_a_split_recording_is_one_whether_its_folder_or_its_files_are_named(split):
    whole = read_log(str(split))
    check_drive(whole)
    files = [str(path) for path in split.glob("my_bag_*")]
    random.Random(1).shuffle(files)
    assert read_log(files).source == whole.source
    check_drive(read_log(files))
    (split / "metadata.yaml").unlink()
    check_drive(read_log(str(split)))
    assert whole.source.name == "my_bag"
    for number, source in enumerate(whole.source.files):
        data = Path(files_of(str(split))[number]).read_bytes()
        assert source.name.startswith(f"my_bag_{number}.")
        assert (source.sha256, source.bytes) == (hashlib.sha256(data).hexdigest(), len(data))


def test_all_that_a_shell_finds_in_a_folder_may_be_named(split):
    check_drive(read_log([str(path) for path in split.iterdir()]))
    for more in ("my_bag_1.db3-wal", "my_bag_1.db3-shm"):
        (split / more).touch()
    if (split / "my_bag_1.db3").exists():
        check_drive(read_log([str(path) for path in split.iterdir()]))
    with pytest.raises(InputDataError, match="the metadata of a ROS 2 bag; give the folder that it is in"):
        read_log(str(split / "metadata.yaml"))


def test_the_files_are_in_order_of_time_whatever_their_names(split):
    names = sorted(path.name for path in split.glob("my_bag_*"))
    first, last = split / names[0], split / names[2]
    first.rename(split / "kept")
    last.rename(first)
    (split / "kept").rename(last)
    log = read_log(str(split))
    check_drive(log)
    assert log.report.backward_stamps == 0
    assert [source.name for source in log.source.files] == [names[2], names[1], names[0]]


def test_more_than_ten_files(tmp_path):
    folder = split_bag2(drive(), tmp_path / "my_bag", "MCAP", 13)
    (folder / "metadata.yaml").unlink()
    check_drive(read_log(str(folder)))
    assert [Path(file).name for file in files_of(str(folder))][9:11] == ["my_bag_9.mcap", "my_bag_10.mcap"]


@pytest.mark.parametrize("compression", ["FILE", "MESSAGE"])
@pytest.mark.parametrize("plugin", ["MCAP", "SQLITE3"])
def test_compressed_by_zstd(tmp_path, plugin, compression):
    folder = split_bag2(drive(), tmp_path / "my_bag", plugin, 2, compression)
    check_drive(read_log(str(folder)))
    (folder / "metadata.yaml").unlink()
    check_drive(read_log(str(folder)))
    check_drive(read_log([str(path) for path in folder.iterdir()]))


def test_a_file_that_stands_there_packed_and_unpacked_is_read_once(tmp_path):
    import zstandard

    folder = split_bag2(drive(), tmp_path / "my_bag", "MCAP", 2, "FILE")
    packed = folder / "my_bag_1.mcap.zstd"
    (folder / "my_bag_1.mcap").write_bytes(
        zstandard.ZstdDecompressor().decompressobj().decompress(packed.read_bytes())
    )
    check_drive(read_log(str(folder)))
    (folder / "metadata.yaml").unlink()
    check_drive(read_log(str(folder)))
    # Somebody has unpacked them all, and metadata.yaml still names the packed ones.
    packed.unlink()
    check_drive(read_log(str(folder)))


def test_a_recording_of_ros_1_that_was_split(tmp_path):
    every = drive()
    names = [f"lab_2011-11-11-11-1{k}-11_{k}.bag" for k in range(3)]
    for k, name in enumerate(names):
        (tmp_path / name).write_bytes(bag1(every[k * 9 : (k + 1) * 9], tmp_path))
    (tmp_path / "made.bag").unlink()
    check_drive(read_log([str(tmp_path / name) for name in names]))
    log = read_log(str(tmp_path))
    check_drive(log)
    assert log.format == "ROS 1 bag"
    alone = read_log(str(tmp_path / names[2]))
    assert alone.report.warnings[0].endswith(
        f"it is file 3 of 3 of a recording: give all of them, {names[0]} to {names[2]}, to read all of it"
    )


def test_one_file_of_a_split_recording_is_read_alone_and_the_rest_told_of(split):
    first = next(split.glob("my_bag_0.*"))
    log = read_log(str(first))
    assert 0 < len(log) < 12
    said = f"it is file 1 of 3 of a recording: give its folder {split} to read all of it"
    assert log.report.warnings[0] == said
    (split / "metadata.yaml").unlink()
    assert "give all of them, my_bag_0." in read_log(str(first)).report.warnings[0]


def test_files_that_are_numbered_otherwise_are_no_parts(tmp_path):
    for name in ("run_1.mcap", "run_2.mcap", "hall-0.mcap", "hall-1.mcap"):
        (tmp_path / name).write_bytes(ros2(drive()))
    check_drive(read_log(str(tmp_path / "run_1.mcap")))
    check_drive(read_log(str(tmp_path / "hall-0.mcap")))


def test_a_file_that_metadata_names_and_that_is_not_there(split):
    next(split.glob("my_bag_2.*")).unlink()
    log = read_log(str(split))
    assert log.report.warnings[0].startswith("my_bag_2.")
    assert "is missing, though metadata.yaml lists it" in log.report.warnings[0]
    assert 6 < len(log) < 12


def test_a_number_that_is_missing(split):
    (split / "metadata.yaml").unlink()
    next(split.glob("my_bag_1.*")).unlink()
    for log in (read_log(str(split)), read_log(sorted(str(path) for path in split.iterdir()))):
        assert log.report.warnings[0] == "parts are missing: number 1"
    next(split.glob("my_bag_0.*")).unlink()
    assert "are missing: number 0, 1" in read_log(str(split)).report.warnings[0]


def test_what_metadata_does_not_name_is_left_out(split, tmp_path):
    shutil.copy(next(split.glob("my_bag_0.*")), split / "copy_0.mcap")
    check_with(read_log(str(split)), "copy_0.mcap is not listed in metadata.yaml and is not read")


@pytest.mark.parametrize(
    "text",
    [b"", b"[]", b"rosbag2_bagfile_information:\n  relative_file_paths: 5\n", b"\xff\xfe", b"a: [" * 9999],
)
def test_metadata_that_cannot_be_read(split, text):
    (split / "metadata.yaml").write_bytes(text)
    log = read_log(str(split))
    (warning,) = log.report.warnings
    assert warning.startswith("metadata.yaml cannot be read and is ignored")
    assert len(log) == 12


def test_metadata_leads_to_no_file_outside_of_the_folder(split, tmp_path):
    (tmp_path / "secret.mcap").write_bytes(ros2(drive()))
    metadata = split / "metadata.yaml"
    text = metadata.read_text().replace(
        "- my_bag_0", f"- {tmp_path}/secret.mcap\n  - ../secret.mcap\n  - my_bag_0"
    )
    metadata.write_text(text)
    log = read_log(str(split))
    assert "secret.mcap is missing" in log.report.warnings[0]
    check_with(log, "its scans are missing too")
    # Some versions have named the folder too.
    metadata.write_text(text.replace("- my_bag_0", "- my_bag/my_bag_0").replace("- ../secret.mcap\n", ""))
    assert len(read_log(str(split))) == 12


def test_metadata_of_files_with_other_names(split):
    for path in split.glob("my_bag_*"):
        path.rename(split / path.name.replace("my_bag", "lab"))
    (warning,) = read_log(str(split)).report.warnings
    assert warning.startswith("metadata.yaml lists other files than lab_0.")


def test_folders_without_a_recording(tmp_path):
    with pytest.raises(InputMissingError, match=r"without a recording, it is empty; name a log"):
        read_log(str(tmp_path))
    (tmp_path / "robot.log").write_text(flaser(1.0))
    (tmp_path / "notes").mkdir()
    (tmp_path / "._my_bag_0.mcap").write_bytes(b"of a Mac")
    with pytest.raises(InputMissingError, match=r"it holds notes/, robot\.log; name a log"):
        read_log(str(tmp_path))


def test_a_folder_of_several_recordings(tmp_path):
    for name in ("run_0.mcap", "hall_0.mcap"):
        (tmp_path / name).write_bytes(ros2(drive()))
    with pytest.raises(
        WrongUsageError, match=r"several recordings, hall_0\.mcap, run_0\.mcap; name the files"
    ):
        read_log(str(tmp_path))
    (tmp_path / "hall_0.mcap").rename(tmp_path / "run_2020-01-01-00-00-00_0.mcap")
    with pytest.raises(WrongUsageError, match="holds several recordings"):
        read_log(str(tmp_path))


def moved(written: list[Written], by: int) -> list[Written]:
    """The same, recorded later."""
    return [replace(one, log_time=one.log_time + by) for one in written]


def test_files_that_were_recorded_at_other_times(tmp_path):
    every = drive()
    (tmp_path / "a.mcap").write_bytes(ros2(every[:20]))
    (tmp_path / "b.mcap").write_bytes(ros2(every[20:]))
    (tmp_path / "c.mcap").write_bytes(ros2(moved(every[20:], LATER)))
    # Their names say nothing: that one goes on where the other ends does.
    check_drive(read_log([str(tmp_path / "b.mcap"), str(tmp_path / "a.mcap")]))
    with pytest.raises(
        WrongUsageError, match=r"c\.mcap begins 3,600 s after a\.mcap ends: they are not files of one"
    ):
        read_log([str(tmp_path / "a.mcap"), str(tmp_path / "c.mcap")])
    (tmp_path / "a.mcap").rename(tmp_path / "my_0.mcap")
    (tmp_path / "c.mcap").rename(tmp_path / "my_1.mcap")
    log = read_log([str(tmp_path / "my_0.mcap"), str(tmp_path / "my_1.mcap")])
    assert log.report.warnings[0] == "my_1.mcap begins 3,600 s after my_0.mcap ends"


def test_topics_that_were_recorded_into_files_of_their_own(tmp_path):
    every = drive()
    for name, scans in (("laser.mcap", True), ("rest.mcap", False)):
        (tmp_path / name).write_bytes(ros2([one for one in every if (one.topic == "/scan") == scans]))
    check_drive(read_log([str(tmp_path / "laser.mcap"), str(tmp_path / "rest.mcap")]))


def test_logs_that_are_no_files_of_one_recording(tmp_path):
    (tmp_path / "a.log").write_text("\n".join(flaser(1.0 + k) for k in range(4)))
    (tmp_path / "a.mcap").write_bytes(ros2(drive()))
    (tmp_path / "a.bag").write_bytes(bag1(drive(), tmp_path))
    (tmp_path / "folder").mkdir()
    for names, said in (
        (
            ("a.mcap", "a.log"),
            r"a\.log: is CARMEN text, not a recording; several LOGs must be the files of one",
        ),
        (("a.mcap", "a.bag"), r"a\.mcap MCAP: they are not files of one recording"),
        (("a.mcap", "folder"), "folder: is a folder beside other LOGs"),
        (("a.mcap", "a.mcap"), "is given twice"),
    ):
        with pytest.raises(WrongUsageError, match=said):
            read_log([str(tmp_path / name) for name in names])
    with pytest.raises(WrongUsageError, match=r"standard input \(-\) cannot be a part of a recording"):
        read_log(["-", str(tmp_path / "a.mcap")])
    with pytest.raises(InputMissingError, match="no such file"):
        read_log([str(tmp_path / "a.mcap"), str(tmp_path / "gone.mcap")])


def test_damage_in_one_of_the_files_is_told_with_its_name(split, tmp_path):
    path = next(split.glob("my_bag_1.*"))
    path.write_bytes(path.read_bytes()[:-3000])
    with pytest.raises(InputDataError, match=r"my_bag_1\."):
        read_log(str(split))
    if path.suffix == ".mcap":
        log = read_log(str(split), ReadingOptions(salvage=True))
        assert log.report.warnings[0].startswith("my_bag_1.mcap: damaged: ")
        assert 8 < len(log) <= 12
