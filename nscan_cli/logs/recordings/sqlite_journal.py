"""What a database has not taken into its file yet: SQLite's write-ahead log, or its rollback journal.

A recorder that was killed, or a copy that was made while it ran, leaves them beside the file. SQLite itself
puts them together, on copies: nothing changes where the files are.
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
from nscan_cli.files.counting import counted

WAL, JOURNAL = "-wal", "-journal"
JOURNAL_END = b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7"
"""The last bytes of a journal that ends with the name of a file."""
HEAD, FRAME = 32, 24
"""Bytes of the header of a write-ahead log, and of each frame's in it (sqlite.org/fileformat2.html)."""
SALTS = slice(16, 24)
FRAME_SALTS = slice(8, 16)


@contextlib.contextmanager
def merged(path: str, beside: Mapping[str, str], file: str, salvage: bool) -> Iterator[tuple[str, list[str]]]:
    """Where a database is with all that stands beside it taken in, and what of that is of no use.

    Raises InputDataError when it is sound only without it, OutputError when there is no room for copies.
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
            taken = _put_together(place)
        except OSError as error:
            problem = f"{folder}: has no copy of {file}: {error.strerror or error}"
            raise OutputError(f"{problem}; make room there, or set TMPDIR") from error
        except (sqlite3.Error, UnicodeDecodeError) as error:
            # Of another database, or damaged, what SQLite quotes of it too: the file alone may be sound.
            names = " and ".join(f"{file}{end}" for end in beside)
            problem = f"does not go together with {names} ({' '.join(str(error).split())})"
            if not salvage:
                remedy = "move that away, or give --salvage, to use what the file has without it"
                raise InputDataError(file, problem, remedy) from error
            yield path, [f"{problem}: what that held is lost"]
            return
        lost = _left_over(beside[WAL], taken) if WAL in beside else ""
        yield place, [f"{file}{WAL}: {lost}"] if lost else []


def _check_journal(path: str) -> None:
    """Refuse a journal with the name of another file at its end, which SQLite would read, and remove.

    Only transactions over several databases have one. Raises sqlite3.Error.
    """
    with contextlib.suppress(FileNotFoundError), open(path + JOURNAL, "rb") as journal:
        journal.seek(-min(len(JOURNAL_END), os.path.getsize(path + JOURNAL)), os.SEEK_END)
        if journal.read() == JOURNAL_END:
            raise sqlite3.DatabaseError("its journal leads to other files")


def _put_together(path: str) -> int:
    """Let SQLite do it; how many frames of the write-ahead log it has taken. Raises sqlite3.Error."""
    with closing(sqlite3.connect(path)) as bag:
        # The first reading plays a journal back.
        next(bag.execute("SELECT count(*) FROM sqlite_master"))
        _busy, taken, _written = next(bag.execute("PRAGMA wal_checkpoint(FULL)"))
        problem = next(bag.execute("PRAGMA integrity_check"))[0]
        if problem != "ok":
            raise sqlite3.DatabaseError(str(problem))
    return max(0, int(taken))


def _left_over(path: str, taken: int) -> str:
    """What is lost of a write-ahead log of which the first frames were taken; empty when nothing is."""
    with open(path, "rb") as wal:
        head = wal.read(HEAD)
        if len(head) < HEAD:
            return ""
        (page,) = struct.unpack_from(">I", head, 8)
        if taken == 0:
            return "does not fit the file or is damaged: what it held is lost"
        left = 0
        wal.seek(HEAD + taken * (FRAME + page))
        while frame := wal.read(FRAME):
            # Frames with other salts are of times past: the file was begun anew over them.
            left += frame[FRAME_SALTS] == head[SALTS]
            wal.seek(page, os.SEEK_CUR)
    return f"{counted(left, 'page')} at its end are not whole: what they held is lost" if left else ""
