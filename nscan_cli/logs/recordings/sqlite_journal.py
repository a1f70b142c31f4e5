"""The write-ahead log or rollback journal beside an SQLite database, applied to a copy of it.

They stay beside the file when a recorder is killed, or when the file is copied while it runs. SQLite itself
applies them to copies in a temporary folder, so the given files do not change.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import sqlite3
import struct
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import closing

from nscan_cli.errors import InputDataError, OutputError
from nscan_cli.files.text import counted

WAL, JOURNAL = "-wal", "-journal"
JOURNAL_END = b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7"
"""The last bytes of a journal that ends with the name of another file."""
WAL_HEADER, FRAME_HEADER = 32, 24
"""Bytes of the header of a write-ahead log, and of each frame in it (sqlite.org/fileformat2.html)."""
SALTS = slice(16, 24)
FRAME_SALTS = slice(8, 16)


@contextlib.contextmanager
def recovered_database(
    path: str, beside: Mapping[str, str], file: str, salvage: bool
) -> Iterator[tuple[str, list[str]]]:
    """The path of a database with its journals `beside` it (suffix → path) applied, and warnings of losses.

    Raises InputDataError when the journals do not fit it (with `salvage` they are left out), OutputError
    when there is no room for the copies.
    """
    if not beside:
        yield path, []
        return
    with tempfile.TemporaryDirectory(prefix="nscan-cli.") as folder:
        place = os.path.join(folder, "bag")
        try:
            for end, source in {"": path, **beside}.items():
                shutil.copyfile(source, place + end)
            _check_journal(place)
            applied = apply_journals(place)
        except OSError as error:
            problem = f"{folder}: has no copy of {file}: {error.strerror or error}"
            raise OutputError(f"{problem}; make room there, or set TMPDIR") from error
        except (sqlite3.Error, UnicodeDecodeError) as error:
            # The journal is damaged or of another database; the file alone may be sound.
            names = " and ".join(f"{file}{end}" for end in beside)
            problem = f"does not match {names} ({' '.join(str(error).split())})"
            if not salvage:
                remedy = "remove that, or give --salvage, to use the file without it"
                raise InputDataError(file, problem, remedy) from error
            yield path, [f"{problem}: its contents are lost"]
            return
        lost = _lost_pages(beside[WAL], applied) if WAL in beside else ""
        yield place, [f"{file}{WAL}: {lost}"] if lost else []


def _check_journal(path: str) -> None:
    """Refuse a journal that names another file at its end, because SQLite would read and remove that file.

    Only transactions over several databases name one. Raises sqlite3.Error.
    """
    with contextlib.suppress(FileNotFoundError), open(path + JOURNAL, "rb") as journal:
        journal.seek(-min(len(JOURNAL_END), os.path.getsize(path + JOURNAL)), os.SEEK_END)
        if journal.read() == JOURNAL_END:
            raise sqlite3.DatabaseError("its journal names other files")


def apply_journals(path: str) -> int:
    """Let SQLite apply them; how many frames of the write-ahead log were used. Raises sqlite3.Error."""
    with closing(sqlite3.connect(path)) as bag:
        # The first query applies a rollback journal.
        next(bag.execute("SELECT count(*) FROM sqlite_master"))
        _busy, applied, _written = next(bag.execute("PRAGMA wal_checkpoint(FULL)"))
        problem = next(bag.execute("PRAGMA integrity_check"))[0]
        if problem != "ok":
            raise sqlite3.DatabaseError(str(problem))
    return max(0, int(applied))


def _lost_pages(path: str, applied: int) -> str:
    """What is lost of a write-ahead log whose first frames were applied; empty when nothing is."""
    with open(path, "rb") as wal:
        head = wal.read(WAL_HEADER)
        if len(head) < WAL_HEADER:
            return ""
        (page,) = struct.unpack_from(">I", head, 8)
        if applied == 0:
            return "does not match the file or is damaged: its contents are lost"
        left = 0
        wal.seek(WAL_HEADER + applied * (FRAME_HEADER + page))
        while frame := wal.read(FRAME_HEADER):
            # Frames with other salts are older: the log was begun again over them.
            left += frame[FRAME_SALTS] == head[SALTS]
            wal.seek(page, os.SEEK_CUR)
    return f"{counted(left, 'page')} at its end are incomplete: their contents are lost" if left else ""
