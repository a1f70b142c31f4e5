"""The folder where the kernels' machine code is cached.

Its name has a hash of all files with kernels. When one of them changes, all kernels are compiled again. So a
constant that a kernel uses must stand in a file with kernels.

When a version makes its folder, obsolete folders are removed. A process that still uses one of them goes on
with what it has loaded, and compiles the rest in memory.
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
from nscan_cli.files.outputs import TEMPORARY_PREFIX, write_once

PACKAGE = Path(__file__).parents[1]
COMPILER_SOURCES = {
    "kernels/cache_folder.py",
    "kernels/decorators.py",
    "kernels/machine_code.py",
    "kernels/numba_shortcuts.py",
    "kernels/whole_kernels.py",
}
"""Files of the package that decide how machine code is compiled and cached."""
FOLDER_NAME = re.compile(r"\d[\w.+]*-[0-9a-f]{16}")
"""The name of a cache folder: a version and a hash."""
OWNER_FILE = ".package"
"""A file with the path of the package that the folder belongs to. Its time is that of the last use."""
COMPILED_FILE, LOCK_FILE = "all", ".compiling"
"""The first, with a build key in its name, exists once kernels are compiled. Who compiles locks the other."""
CACHE_FILES = re.compile(
    rf"{re.escape(OWNER_FILE)}|{COMPILED_FILE}-([0-9a-f]{{16}}|None)|{re.escape(LOCK_FILE)}"
    rf"|{re.escape(TEMPORARY_PREFIX)}.*|.*\.(code|left|lock|nbc|nbi)(\.tmp\..*)?"
)
"""Names of the files that nscan-cli and numba write into the folder."""
DAY = 86400.0
EXPIRY = 30 * DAY
"""Time without use after which the folder of another copy of the package is obsolete, s."""


@functools.cache
def cache_folder() -> Path | None:
    """The folder for the kernels' machine code; None where none is writable.

    It is in `NUMBA_CACHE_DIR` if that is set, else in the user's cache folder; if that is not writable, in a
    private folder among the temporary files.
    """
    key = f"{__version__}-{_sources_hash()}"
    for place in _candidates():
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
    """Mark the folder as used, once a day. When it is new, remove obsolete folders and name its owner."""
    owner = folder / OWNER_FILE
    try:
        if time.time() - owner.stat().st_mtime > DAY:
            os.utime(owner)
    except FileNotFoundError:
        for other in os.scandir(folder.parent):
            if FOLDER_NAME.fullmatch(other.name) and other.name != folder.name and _is_obsolete(other):
                _remove_cache_files(other.path)
        write_once(owner, os.fsencode(PACKAGE))


def _is_obsolete(other: os.DirEntry[str]) -> bool:
    """Whether a cache folder is of no more use.

    That is so if its package is gone or has other kernels now, if it was not used for EXPIRY, or if it has no
    owner file, as folders of old versions.
    """
    if not other.is_dir(follow_symlinks=False):
        return False
    try:
        package = Path(other.path, OWNER_FILE).read_bytes()
        used = os.stat(os.path.join(other.path, OWNER_FILE)).st_mtime
    except FileNotFoundError:
        return True
    return package == os.fsencode(PACKAGE) or not os.path.isdir(package) or time.time() - used > EXPIRY


def _remove_cache_files(folder: str) -> None:
    """Remove the cached files below a folder, then empty folders; links are not followed."""
    for place, _folders, names in os.walk(folder, topdown=False):
        for name in filter(CACHE_FILES.fullmatch, names):
            with contextlib.suppress(OSError):
                os.unlink(os.path.join(place, name))
        with contextlib.suppress(OSError):
            os.rmdir(place)


def _candidates() -> Iterator[Path]:
    configured = os.environ.get("NUMBA_CACHE_DIR")
    user = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    yield Path(configured or user).absolute() / "nscan-cli"
    try:
        private = Path(tempfile.gettempdir()) / f"nscan-cli-{os.getuid()}"
        private.mkdir(mode=0o700, exist_ok=True)
        status = private.lstat()
    except OSError:
        return
    # Code from here is run, so nobody else may be able to write here.
    if stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & 0o022:
        yield private


def _sources_hash() -> str:
    """Hash of the package's path, and of the paths and bytes of all its files with kernels or NamedTuples.

    The package's path is part of it because numba caches each copy of a file separately.
    """
    digest = hashlib.sha256(os.fsencode(PACKAGE) + b"\0")
    for path in sorted(PACKAGE.rglob("*.py")):
        text = path.read_bytes()
        # Kernels take NamedTuples of options, which files without kernels define.
        decides = b"nscan_cli.kernels.decorators import" in text or b"(NamedTuple)" in text
        if decides or path.relative_to(PACKAGE).as_posix() in COMPILER_SOURCES:
            digest.update(f"{path.relative_to(PACKAGE)}\0{len(text)}\0".encode() + text)
    return digest.hexdigest()[:16]
