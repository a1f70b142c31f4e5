"""What a database has not taken into its file yet: SQLite's write-ahead log, or its rollback journal.

A recorder that was killed, or a copy that was made while it ran, leaves them beside the file. SQLite itself
puts them together, on copies: nothing changes where the files are.
"""

from __future__ import annotations

import sqlite3
import struct
import tempfile
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path

from nscan_cli.counting import counted
from nscan_cli.errors import InputDataError, OutputError

WAL = "-wal"
HEAD, FRAME = 32, 24
"""Bytes of the header of a write-ahead log, and of each frame's in it (sqlite.org/fileformat2.html)."""
SALTS = slice(16, 24)
FRAME_SALTS = slice(8, 16)


def merged(data: bytes, file: str, salvage: bool, beside: Mapping[str, bytes]) -> tuple[bytes, list[str]]:
    """The database with what stands beside it, and what of that is of no use.

    Raises InputDataError when the database is sound only without it, OutputError when there is no room for
    the copies.
    """
    names = " and ".join(f"{file}{end}" for end in beside)
    try:
        whole, taken = _put_together(data, beside)
    except sqlite3.Error as error:
        # Of another database, or damaged: the file alone may be sound.
        problem = f"does not go together with {names} ({' '.join(str(error).split())})"
        if not salvage:
            remedy = "move that away, or give --salvage, to use what the file has without it"
            raise InputDataError(file, problem, remedy) from error
        return data, [f"{problem}: what that held is lost"]
    lost = _left_over(beside.get(WAL, b""), taken)
    return whole, [f"{file}{WAL}: {lost}"] if lost else []


def _put_together(data: bytes, beside: Mapping[str, bytes]) -> tuple[bytes, int]:
    """The database, and how many frames of the write-ahead log are in it. Raises sqlite3.Error."""
    try:
        with tempfile.TemporaryDirectory(prefix="nscan-cli.") as folder:
            path = Path(folder, "bag")
            path.write_bytes(data)
            for end, content in beside.items():
                path.with_name(path.name + end).write_bytes(content)
            with closing(sqlite3.connect(path)) as bag:
                # The first reading plays a journal back.
                next(bag.execute("SELECT count(*) FROM sqlite_master"))
                _busy, taken, _written = next(bag.execute("PRAGMA wal_checkpoint(FULL)"))
                problem = next(bag.execute("PRAGMA integrity_check"))[0]
                if problem != "ok":
                    raise sqlite3.DatabaseError(str(problem))
            return path.read_bytes(), max(0, taken)
    except OSError as error:
        problem = f"{tempfile.gettempdir()}: cannot take a copy of the recording: {error.strerror or error}"
        raise OutputError(f"{problem}; make room there, or set TMPDIR") from error


def _left_over(wal: bytes, taken: int) -> str:
    """What is lost of a write-ahead log of which the first frames were taken; empty when nothing is."""
    if len(wal) <= HEAD:
        return ""
    (page,) = struct.unpack_from(">I", wal, 8)
    size = FRAME + page
    if taken == 0:
        return "does not fit the file or is damaged: what it held is lost"
    left = 0
    for at in range(HEAD + taken * size, len(wal), size):
        # Frames with other salts are of times past: the file was begun anew over them.
        left += wal[at : at + FRAME][FRAME_SALTS] == wal[SALTS]
    return f"{counted(left, 'page')} at its end are not whole: what they held is lost" if left else ""
