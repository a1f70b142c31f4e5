"""The folder where the kernels' machine code is kept.

It carries a hash of all files with kernels: when one of them changes, all are compiled again. A constant
that a kernel uses belongs into a file with kernels.

When a version makes its folder, those that nobody needs any more go. A process that still uses one of them
keeps what it has loaded; what it has not, it compiles and keeps in memory.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import re
import stat
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from nscan_cli import __version__
from nscan_cli.files.outputs import TEMPORARY, write_first

PACKAGE = Path(__file__).parents[1]
MAKERS = {"kernels/cache_folder.py", "kernels/decorators.py", "kernels/machine_code.py"}
"""Files of the package that say how machine code is made and kept."""
NAME = re.compile(r"\d[\w.+]*-[0-9a-f]{16}")
"""Of a folder: a version and a hash."""
OWNER = ".package"
"""A file of the folder that has the place of its package. Its time says when the folder was last used."""
KEPT = re.compile(rf"{re.escape(OWNER)}|{re.escape(TEMPORARY)}.*|.*\.(code|left|nbc|nbi)(\.tmp\..*)?")
"""Names of the files that nscan-cli and numba keep in it."""
DAY = 86400.0
UNUSED = 30 * DAY
"""So long nobody has used the folder of another copy of the package that need not be kept, s."""


@functools.cache
def cache_folder() -> Path | None:
    """The folder for the kernels' machine code; None when no place is writable.

    The first that can be written of: `NUMBA_CACHE_DIR` where it is set, otherwise the user's cache
    folder; a folder of this user among the temporary files.
    """
    key = f"{__version__}-{_sources_hash()}"
    for place in _places():
        folder = place / key
        try:
            folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
        except OSError:
            continue
        with contextlib.suppress(OSError):
            _claim(folder)
        return folder
    return None


def _claim(folder: Path) -> None:
    """Say whose the folder is, and once a day that it is used; when it is new, clear others away."""
    owner = folder / OWNER
    try:
        if time.time() - owner.stat().st_mtime > DAY:
            os.utime(owner)
    except FileNotFoundError:
        for other in os.scandir(folder.parent):
            if NAME.fullmatch(other.name) and other.name != folder.name and _is_over(other):
                _clear(other.path)
        write_first(owner, os.fsencode(PACKAGE))


def _is_over(other: os.DirEntry[str]) -> bool:
    """Whether what is kept in a folder is of no more use.

    It is that of a copy of the package that is gone, or has other kernels now; was not used for a month; or
    does not say whose it is: an old version has made it.
    """
    if not other.is_dir(follow_symlinks=False):
        return False
    try:
        package = Path(other.path, OWNER).read_bytes()
        used = os.stat(os.path.join(other.path, OWNER)).st_mtime
    except FileNotFoundError:
        return True
    return package == os.fsencode(PACKAGE) or not os.path.isdir(package) or time.time() - used > UNUSED


def _clear(folder: str) -> None:
    """Remove the files that are kept in a folder, and what is empty then; links are not followed."""
    for place, _folders, names in os.walk(folder, topdown=False):
        for name in filter(KEPT.fullmatch, names):
            with contextlib.suppress(OSError):
                os.unlink(os.path.join(place, name))
        with contextlib.suppress(OSError):
            os.rmdir(place)


def _places() -> Iterator[Path]:
    configured = os.environ.get("NUMBA_CACHE_DIR")
    user = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    yield Path(configured or user).absolute() / "nscan-cli"
    try:
        private = Path(tempfile.gettempdir()) / f"nscan-cli-{os.getuid()}"
        private.mkdir(mode=0o700, exist_ok=True)
        status = private.lstat()
    except OSError:
        return
    # What is loaded from here is run: the folder must not be one that somebody else has laid out.
    if stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & 0o022:
        yield private


def _sources_hash() -> str:
    """Hash of the package's place, and of the paths and bytes of all its files that make kernels.

    Of the place because numba keeps the code of each copy of a file apart.
    """
    sources = hashlib.sha256(os.fsencode(PACKAGE) + b"\0")
    for path in sorted(PACKAGE.rglob("*.py")):
        text = path.read_bytes()
        if path.relative_to(PACKAGE).as_posix() in MAKERS or b"nscan_cli.kernels.decorators import" in text:
            sources.update(f"{path.relative_to(PACKAGE)}\0{len(text)}\0".encode() + text)
    return sources.hexdigest()[:16]
