"""`nscan-cli warm-up`: compile all kernels beforehand."""

from __future__ import annotations

import time

from nscan_cli.cli.compilation import Compiling
from nscan_cli.cli.progress import say
from nscan_cli.cli.shared_options import common_options
from nscan_cli.cli.subcommand import subcommand
from nscan_cli.errors import OutputError


@subcommand(
    "warm-up",
    ("nscan-cli warm-up", "once after the installation"),
    ("nscan-cli warm-up -q", "in a Dockerfile"),
)
@common_options
def command(quiet: bool, **_verbosity: int) -> None:
    """Compile all numerical code now, so that no later run has to.

    It stays in NUMBA_CACHE_DIR, or in the user's cache folder (XDG_CACHE_HOME, or ~/.cache), and fits this
    version of nscan-cli, Python and the processor only.
    """
    from nscan_cli.kernels.cache_folder import cache_folder

    folder = cache_folder()
    if folder is None:
        raise OutputError("no folder for compiled code is writable; set NUMBA_CACHE_DIR to one that is")
    began = time.perf_counter()
    compiling = Compiling("half a minute to a minute", quiet)
    compiling.all(folder)
    took = f"compiled in {time.perf_counter() - began:.0f} s" if compiling.has_begun else "nothing to compile"
    say(f"{took}: {folder}", quiet)
