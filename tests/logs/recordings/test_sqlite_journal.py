"""Databases that were copied before SQLite had taken everything into them."""

from __future__ import annotations

import hashlib
import os
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from nscan_cli.errors import InputDataError
from nscan_cli.logs.load import read_log
from nscan_cli.logs.log_files import files_of
from nscan_cli.logs.reading_options import ReadingOptions
from tests.logs.recordings.messages import check_drive, drive
from tests.logs.recordings.ros import db3

SALVAGE = ReadingOptions(salvage=True)


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """A bag of drive() whose newer half is in the write-ahead log beside it, in a folder of its own."""
    whole, path = tmp_path / "whole.db3", tmp_path / "made.db3"
    whole.write_bytes(db3(drive(), tmp_path))
    path.write_bytes(whole.read_bytes())
    folder = tmp_path / "given"
    folder.mkdir()
    with closing(sqlite3.connect(whole)) as source:
        rows = list(source.execute("SELECT id, topic_id, timestamp, data FROM messages ORDER BY id"))
    with closing(sqlite3.connect(path)) as database:
        database.execute("PRAGMA journal_mode=WAL")
        database.execute("DELETE FROM messages WHERE id > 14")
        database.commit()
        database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows[14:20])
        database.commit()
        database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows[20:])
        database.commit()
        # As they are while the recorder runs.
        shutil.copy(path, folder / "lab.db3")
        shutil.copy(f"{path}-wal", folder / "lab.db3-wal")
    return folder / "lab.db3"


def wal_of(bag: Path) -> Path:
    return bag.with_name(f"{bag.name}-wal")


def test_what_is_in_the_write_ahead_log_is_read_and_nothing_is_touched(bag):
    alone = bag.with_name("alone.db3")
    shutil.copy(bag, alone)
    assert len(read_log(str(alone))) < 8
    alone.unlink()
    before = {path.name: (path.read_bytes(), path.stat().st_mtime_ns) for path in bag.parent.iterdir()}
    bag.parent.chmod(0o500)
    log = read_log(str(bag))
    bag.parent.chmod(0o700)
    check_drive(log)
    assert {
        path.name: (path.read_bytes(), path.stat().st_mtime_ns) for path in bag.parent.iterdir()
    } == before
    assert [source.name for source in log.source.files] == ["lab.db3", "lab.db3-wal"]
    for source in log.source.files:
        assert source.sha256 == hashlib.sha256(before[source.name][0]).hexdigest()
    assert log.source.name == "lab.db3"
    assert files_of(str(bag)) == [str(bag), str(wal_of(bag))]


def test_a_link_and_a_folder_lead_to_both(bag, tmp_path):
    (tmp_path / "link.db3").symlink_to(bag)
    log = read_log(str(tmp_path / "link.db3"))
    check_drive(log)
    assert [source.name for source in log.source.files] == ["link.db3", "link.db3-wal"]
    check_drive(read_log(str(bag.parent)))
    # Who names all files of a folder names it too.
    check_drive(read_log([str(wal_of(bag)), str(bag)]))


def test_a_write_ahead_log_on_its_own_is_named(bag):
    with pytest.raises(InputDataError, match=r"write-ahead log of an SQLite database; give the \.db3"):
        read_log(str(wal_of(bag)))


def test_an_empty_write_ahead_log_is_no_input(bag):
    wal_of(bag).write_bytes(b"")
    log = read_log(str(bag))
    assert log.source.parts == ()
    assert not any("-wal" in warning for warning in log.report.warnings)


@pytest.mark.parametrize("damage", ["salts", "checksum", "zeros"])
def test_a_write_ahead_log_that_does_not_fit_is_told_of(bag, damage):
    wal = bytearray(wal_of(bag).read_bytes())
    wal[{"salts": 16, "checksum": 24, "zeros": 0}[damage]] ^= 0xFF
    wal_of(bag).write_bytes(bytes(len(wal)) if damage == "zeros" else wal)
    log = read_log(str(bag))
    assert len(log) < 8
    assert any(
        warning == f"{bag}-wal: does not match the file or is damaged: its contents are lost"
        for warning in log.report.warnings
    )


def test_the_end_of_a_write_ahead_log_is_damaged(bag):
    wal = wal_of(bag).read_bytes()
    page = int.from_bytes(wal[8:12], "big")
    frames = (len(wal) - 32) // (24 + page)
    broken = bytearray(wal)
    broken[-10] ^= 0xFF
    for content in (broken, wal[:-10]):
        wal_of(bag).write_bytes(content)
        log = read_log(str(bag))
        assert 6 < len(log) < 12
        (said,) = [warning for warning in log.report.warnings if "-wal: " in warning]
        assert "at its end are incomplete: their contents are lost" in said
        assert 0 < int(said.split("-wal: ")[1].split()[0]) < frames


def test_frames_of_times_past_are_nothing_lost(bag):
    """SQLite begins the file anew, and what stood behind remains until it is written over."""
    wal = wal_of(bag).read_bytes()
    page = int.from_bytes(wal[8:12], "big")
    past = bytearray(wal[32 : 32 + 24 + page])
    past[8] ^= 0xFF
    wal_of(bag).write_bytes(wal + past)
    check_drive(read_log(str(bag)))


def test_a_write_ahead_log_of_another_database(bag, tmp_path):
    other = tmp_path / "other.db3"
    with closing(sqlite3.connect(other)) as database:
        database.execute("PRAGMA journal_mode=WAL")
        database.execute("CREATE TABLE songs (title)")
        database.executemany("INSERT INTO songs VALUES (?)", [("x" * 999,)] * 99)
        database.commit()
        shutil.copy(f"{other}-wal", wal_of(bag))
    with pytest.raises(InputDataError, match=r"SQLite database, but no ROS 2 bag|does not match"):
        read_log(str(bag))


def test_a_write_ahead_log_that_breaks_the_database(bag, monkeypatch):
    from nscan_cli.logs.recordings import sqlite_journal

    def broken(*_given):
        raise sqlite3.DatabaseError("malformed")

    monkeypatch.setattr(sqlite_journal, "apply_journals", broken)
    with pytest.raises(InputDataError, match=r"lab\.db3-wal \(malformed\); remove that, or give --salvage"):
        read_log(str(bag))
    log = read_log(str(bag), SALVAGE)
    assert len(log) < 8
    assert "its contents are lost" in log.report.warnings[0]


@pytest.fixture
def cut_off(tmp_path: Path) -> Path:
    """A bag in the middle of a transaction: the journal has what the pages were before."""
    path = tmp_path / "lab.db3"
    path.write_bytes(db3(drive(), tmp_path))
    folder = tmp_path / "given"
    folder.mkdir()
    with closing(sqlite3.connect(path)) as database:
        database.execute("PRAGMA cache_size=1")
        database.execute("PRAGMA journal_mode=DELETE")
        database.execute("UPDATE messages SET data = zeroblob(5000)")
        assert os.path.getsize(f"{path}-journal") > 0
        shutil.copy(path, folder / "lab.db3")
        shutil.copy(f"{path}-journal", folder / "lab.db3-journal")
    return folder / "lab.db3"


def test_a_journal_is_played_back(cut_off):
    log = read_log(str(cut_off))
    check_drive(log)
    assert [source.name for source in log.source.files] == ["lab.db3", "lab.db3-journal"]


def test_a_journal_removes_no_other_file(cut_off, tmp_path):
    """SQLite takes the name at its end for that of a journal over several databases."""
    other = tmp_path / "letter.txt"
    other.write_text("Dear all,")
    name, magic = str(other).encode(), b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7"
    with Path(f"{cut_off}-journal").open("ab") as journal:
        journal.write(bytes(4) + name + len(name).to_bytes(4, "big") + sum(name).to_bytes(4, "big") + magic)
    with pytest.raises(InputDataError, match=r"does not match .*its journal names other files"):
        read_log(str(cut_off))
    assert other.read_text() == "Dear all,"
