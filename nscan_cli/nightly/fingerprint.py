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
from nscan_cli.files.inputs import common_hash, sha256_of
from nscan_cli.logs.log_files import files_of
from nscan_cli.nightly.manifest import ManifestEntry

OUTSIDE_RESULTS = ("cli/", "nightly/", "exports/", "files/outputs.py")
"""Packages and modules whose code does not go into the results of a night."""
MAKES_RESULTS = ("nightly/worker.py", "nightly/map_preview.py")
"""But these files do."""


@functools.cache
def tool_key() -> str:
    """Version of the tool and hash of all its code that goes into the results of a night."""
    package = Path(__file__).parent.parent
    sources = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        name = path.relative_to(package)
        if name.as_posix().startswith(OUTSIDE_RESULTS) and name.as_posix() not in MAKES_RESULTS:
            continue
        text = path.read_bytes()
        sources.update(f"{name.as_posix()}\0{len(text)}\0".encode() + text)
    return f"{__version__}-{sources.hexdigest()[:16]}"


def input_hash(path: Path, role: str) -> str:
    """SHA-256 of an input; of a log of several files as inputs.common_hash, of any other of its bytes.

    Raises InputMissingError when it cannot be read, or is no file at all, and the errors of files_of.
    """
    files = files_of(str(path)) if role == "log" else [str(path)]
    hashes = []
    for file in files:
        # From a named pipe nobody might ever write to, one would read for ever.
        if Path(file).exists() and not Path(file).is_file():
            raise InputMissingError(f"{file}: is no file; name one")
        hashes.append(sha256_of(file))
    return hashes[0] if len(hashes) == 1 else common_hash(hashes)


def log_size(path: Path) -> int:
    """Bytes of the files that a log at `path` consists of."""
    return sum(Path(file).stat().st_size for file in files_of(str(path)))


def inputs_and_parameters(entry: ManifestEntry, hashes: dict[str, str]) -> dict[str, Any]:
    """Inputs and parameters of a log, so that what has changed can be told."""
    inputs = {role: [path.name, hashes[role]] for role, path in entry.inputs.items()}
    return {"inputs": inputs, "parameters": entry.parameters.as_table()}


def fingerprint(entry: ManifestEntry, hashes: dict[str, str]) -> str:
    """The SHA-256 of all that the results of a log follow from; `hashes` are those of its inputs by role."""
    everything = {
        "tool": tool_key(),
        # The names too: the results carry them.
        "inputs": {role: [path.name, hashes[role]] for role, path in entry.inputs.items()},
        "reading": dataclasses.asdict(entry.parameters.reading),
        "mapping": entry.parameters.mapping,
    }
    return hashlib.sha256(json.dumps(everything, sort_keys=True).encode()).hexdigest()
