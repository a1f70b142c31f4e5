"""`kernel`, the decorator of compiled functions, and the folder where their machine code is kept.

numba keeps compiled functions one by one and notices a change of a function's own file only, not of
what it calls in other files. So the folder carries a hash of all files with kernels: when one of them
changes, all are compiled again. A constant that a kernel uses belongs into a file with kernels.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import stat
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar, cast

from nscan_cli import __version__

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """Compile `function` at its first call with numba, or load its machine code from the cache folder.

    No parallel loops, and of fastmath only fused multiply-adds, which change no order: the same bytes come
    out on any number of threads. The interpreter's lock is released, so threads can share the work.
    """
    return _compiled(function, {"contract"})


def lean_kernel(function: Function) -> Function:
    """The same for what is called in the loops of other kernels: it makes no arrays.

    It counts no references to the arrays that it is given: in a loop that takes longer than the work.
    """
    return _compiled(function, {"contract"}, _nrt=False)


def inlined_kernel(function: Function) -> Function:
    """The same for what gives lean kernels a part of their arrays: it becomes part of them."""
    return _compiled(function, {"contract"}, inline="always")


def summing_kernel(function: Function) -> Function:
    """A lean kernel whose loop does nothing but sum: its terms may be summed in lanes, side by side.

    How many lanes there are depends on the processor, on nothing else.
    """
    return _compiled(function, {"contract", "reassoc", "nsz"}, _nrt=False)


def _compiled(function: Function, fastmath: set[str], **options: Any) -> Function:
    import numba

    config: Any = numba.config
    folder = cache_folder()
    # numba picks a function's folder when it is decorated: other users of numba in this process keep
    # theirs.
    configured, config.CACHE_DIR = config.CACHE_DIR, "" if folder is None else str(folder)
    try:
        compile_lazily = numba.njit(
            cache=folder is not None, nogil=True, error_model="numpy", fastmath=fastmath, **options
        )
        compiled = compile_lazily(function)
    finally:
        config.CACHE_DIR = configured
    _forgive(getattr(compiled, "_cache"))  # noqa: B009, numba's types do not have it
    return cast(Function, compiled)


def _forgive(cache: Any) -> None:
    """Let no folder that is full or damaged stop the work: what cannot be loaded is compiled anew."""
    load, save = cache.load_overload, cache.save_overload

    def load_if_sound(*call: Any) -> Any:
        try:
            return load(*call)
        except Exception:
            # What is damaged can raise anything. An empty index takes its place.
            with contextlib.suppress(Exception):
                cache.flush()
            return None

    def save_if_possible(*call: Any) -> None:
        with contextlib.suppress(OSError):
            save(*call)

    cache.load_overload, cache.save_overload = load_if_sound, save_if_possible


def first_compile(name: str) -> bool:
    """Whether the kernel `name` is still to be compiled: it is not in the cache folder, or there is none."""
    folder = cache_folder()
    return folder is None or next(folder.rglob(f"*.{name}-*.nbi"), None) is None


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
    """Hash of the package's place, and of the paths and bytes of all its files that import `kernel`.

    Of the place because numba keeps the code of each copy of a file apart.
    """
    package = Path(__file__).parent
    sources = hashlib.sha256(f"{package}\0".encode())
    for path in sorted(package.rglob("*.py")):
        text = path.read_bytes()
        if b"nscan_cli.compiled import" in text:
            sources.update(f"{path.relative_to(package)}\0{len(text)}\0".encode() + text)
    sources.update(Path(__file__).read_bytes())
    return sources.hexdigest()[:16]
