"""What a result was made from, as every document says it: the tool, the inputs and the parameters."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from nscan_cli import __version__
from nscan_cli.files.source import Source


def provenance_of(sources: Iterable[Source], parameters: dict[str, Any]) -> dict[str, Any]:
    """Tool with version, inputs by base name, SHA-256 and size, and all parameters (m, rad)."""
    return {
        "tool": {"name": "nscan-cli", "version": __version__},
        "inputs": [
            {"name": file.name, "sha256": file.sha256, "bytes": file.bytes}
            for source in sources
            for file in source.files
        ],
        "parameters": parameters,
    }


def is_made_from(inputs: Sequence[dict[str, Any]], source: Source) -> bool:
    """Whether the inputs of a document are the files of this source, in whatever order."""
    return sorted(file["sha256"] for file in inputs) == sorted(file.sha256 for file in source.files)
