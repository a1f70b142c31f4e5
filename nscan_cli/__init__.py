"""nscan-cli: 2D laser logs to globally consistent maps by nScan-Matching (Biber & Straßer 2006).

The public names below are described in docs/python.md. Each is imported at its first use.
"""

from __future__ import annotations

# Not from `typing`, whose import takes longer than everything else here; mypy takes it for True.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from nscan_cli.api import build_graph, make_grid, match, nscan, save_graph
    from nscan_cli.graph.io.load_graph import load_graph
    from nscan_cli.logs.load import read_log
    from nscan_cli.logs.reading_options import ReadingOptions

__version__ = "0.1.0"
__all__ = [
    "ReadingOptions",
    "build_graph",
    "load_graph",
    "make_grid",
    "match",
    "nscan",
    "read_log",
    "save_graph",
]
_ELSEWHERE = {"ReadingOptions": "logs.reading_options", "load_graph": "graph.io.load_graph",
              "read_log": "logs.load"}  # fmt: skip
"""The modules of the names that are not in `api`."""


def __getattr__(name: str) -> object:
    """A public name, imported now."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    found = getattr(importlib.import_module(f"{__name__}.{_ELSEWHERE.get(name, 'api')}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
