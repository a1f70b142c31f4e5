"""When a result is up to date: while log, reference, parameters and the code that made it are the same."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
from pathlib import Path
from typing import Any

from nscan_cli import __version__
from nscan_cli.errors import InputMissingError
from nscan_cli.inputs import read_bytes
from nscan_cli.nightly.manifest import Entry

NO_RESULTS = ("cli", "nightly", "exports", "outputs.py")
"""Packages and modules whose code does not go into the results of a night."""
MAKING = ("work.py", "preview.py")
"""But these files of this one do."""


@functools.cache
def tool_key() -> str:
    """Version of the tool and hash of all its code that goes into the results of a night."""
    package = Path(__file__).parent.parent
    sources = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        name = path.relative_to(package)
        if name.parts[0] in NO_RESULTS and not (name.parts[0] == "nightly" and name.name in MAKING):
            continue
        text = path.read_bytes()
        sources.update(f"{name.as_posix()}\0{len(text)}\0".encode() + text)
    return f"{__version__}-{sources.hexdigest()[:16]}"


def sha256_of(path: Path) -> str:
    """SHA-256 of a file's bytes. Raises InputMissingError when it cannot be read, or is no file at all."""
    # From a named pipe nobody might ever write to, one would read for ever.
    if path.exists() and not path.is_file():
        raise InputMissingError(f"{path}: is no file; name one")
    return hashlib.sha256(read_bytes(str(path))).hexdigest()


def made_from(entry: Entry, hashes: dict[str, str]) -> dict[str, Any]:
    """Inputs and parameters of a log, so that what has changed can be told."""
    inputs = {role: [path.name, hashes[role]] for role, path in entry.inputs.items()}
    return {"inputs": inputs, "parameters": entry.parameters.as_table()}


def fingerprint(entry: Entry, hashes: dict[str, str]) -> str:
    """The SHA-256 of all that the results of a log follow from; `hashes` are those of its inputs by role."""
    everything = {
        "tool": tool_key(),
        # The names too: the results carry them.
        "inputs": {role: [path.name, hashes[role]] for role, path in entry.inputs.items()},
        "reading": dataclasses.asdict(entry.parameters.reading),
        "mapping": entry.parameters.mapping,
    }
    return hashlib.sha256(json.dumps(everything, sort_keys=True).encode()).hexdigest()
