"""The JSON documents of matches: one key a line, always in the same order, no NaN."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nscan_cli.matching.uncertainty import Weakest

DOCUMENT_UNITS = {"length": "m", "angle": "rad"}


def document(name: str, provenance: dict[str, Any], fields: dict[str, Any]) -> bytes:
    """The document of format `name` in UTF-8, with a final line feed."""
    head = {"format": name, "version": "1.0", "units": DOCUMENT_UNITS, "provenance": provenance}
    lines = [
        f'"{key}":{json.dumps(value, separators=(",", ":"), allow_nan=False)}'
        for key, value in {**head, **fields}.items()
    ]
    return ("{" + ",\n".join(lines) + "}\n").encode()


def weakest_record(weakest: Weakest) -> dict[str, Any]:
    """The JSON object of the direction that is known least."""
    from nscan_cli.graph.io.json_fields import six_digits

    sigma = None if weakest.sigma is None else six_digits(weakest.sigma)
    return {"direction": six_digits(weakest.direction), "sigma": sigma}
