"""What a result was made from, as every document says it: the tool, the inputs and the parameters."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from nscan_cli import __version__

if TYPE_CHECKING:
    from nscan_cli.logs.scan import Source


def provenance_of(sources: Iterable[Source], parameters: dict[str, Any]) -> dict[str, Any]:
    """Tool with version, inputs by base name, SHA-256 and size, and all parameters (m, rad)."""
    return {
        "tool": {"name": "nscan-cli", "version": __version__},
        "inputs": [
            {"name": source.name, "sha256": source.sha256, "bytes": source.bytes} for source in sources
        ],
        "parameters": parameters,
    }
