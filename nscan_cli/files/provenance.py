"""The provenance in every result: tool, inputs and parameters."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from nscan_cli import __version__
from nscan_cli.files.source import Source


def provenance_of(sources: Iterable[Source], parameters: dict[str, Any]) -> dict[str, Any]:
    """The tool with version, the inputs with base name, SHA-256 and size, and all parameters (m, rad)."""
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
    """Whether the inputs of a document are the files of this source, in any order."""
    return sorted(file["sha256"] for file in inputs) == sorted(file.sha256 for file in source.files)
