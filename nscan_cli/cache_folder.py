"""The folder where the kernels' machine code is kept.

It carries a hash of all files with kernels: when one of them changes, all are compiled again. A constant
that a kernel uses belongs into a file with kernels.
"""

from __future__ import annotations

import functools
import hashlib
import os
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

from nscan_cli import __version__

PACKAGE = Path(__file__).parent
MAKERS = {"cache_folder.py", "compiled.py", "machine_code.py"}
"""Files of the package that say how machine code is made and kept."""


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
        return folder
    return None


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
    sources = hashlib.sha256(f"{PACKAGE}\0".encode())
    for path in sorted(PACKAGE.rglob("*.py")):
        text = path.read_bytes()
        if path.name in MAKERS or b"nscan_cli.compiled import" in text:
            sources.update(f"{path.relative_to(PACKAGE)}\0{len(text)}\0".encode() + text)
    return sources.hexdigest()[:16]
