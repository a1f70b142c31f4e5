"""The data of a viewer, unpacked as unpack.js does."""

from __future__ import annotations

import base64
import gzip
import json
import re
from typing import Any

import numpy as np


def block_of(page: str) -> bytes:
    """The block in the first viewer of a page."""
    found = re.search(r'<script type="application/octet-stream">([^<]*)</script>', page)
    assert found
    return base64.b64decode(found[1])


def unpack(block: bytes) -> dict[str, Any]:
    """The header, with the arrays that it lists by their names."""
    data = gzip.decompress(block)
    length = int.from_bytes(data[:4], "little")
    header: dict[str, Any] = json.loads(data[4 : 4 + length])
    for name, kind, place, count in header.pop("arrays"):
        header[name] = np.frombuffer(data, f"<{kind}", count, 4 + length + place)
    return header


def ranges_of(header: dict[str, Any]) -> np.ndarray:
    """(M, B) the ranges, m; 0 where nothing returned."""
    low, high = header["ranges"].astype(np.int64).reshape(2, -1, header["beams"])
    coded = low | high << 8
    steps = coded >> 1 ^ -(coded & 1)
    ranges: np.ndarray = header["unit"] * (np.cumsum(steps, axis=1) % 2**16)
    return ranges
