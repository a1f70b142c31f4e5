"""The JSON documents of matches: one key a line, always in the same order, no NaN."""

from __future__ import annotations

import json
from typing import Any

from nscan_cli import __version__
from nscan_cli.logs.scan import Source

UNITS = {"length": "m", "angle": "rad"}


def document(name: str, provenance: dict[str, Any], fields: dict[str, Any]) -> bytes:
    """The document of format `name` in UTF-8, with a final line feed."""
    head = {"format": name, "version": "1.0", "units": UNITS, "provenance": provenance}
    lines = [
        f'"{key}":{json.dumps(value, separators=(",", ":"), allow_nan=False)}'
        for key, value in {**head, **fields}.items()
    ]
    return ("{" + ",\n".join(lines) + "}\n").encode()


def provenance_of(sources: list[Source], parameters: dict[str, Any]) -> dict[str, Any]:
    """What a result was made from, as in the graph."""
    return {
        "tool": {"name": "nscan-cli", "version": __version__},
        "inputs": [
            {"name": source.name, "sha256": source.sha256, "bytes": source.bytes} for source in sources
        ],
        "parameters": parameters,
    }
