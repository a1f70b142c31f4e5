"""Fingerprints: a result is up to date as long as its log, reference, parameters and code are the same."""

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
"""Packages and modules whose code does not affect the results of a log."""
MAKES_RESULTS = ("nightly/worker.py",)
"""Modules in OUTSIDE_RESULTS whose code affects the results nevertheless."""


@functools.cache
def tool_key() -> str:
    """The version of nscan-cli and a hash of the code that affects the results of a log."""
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
    """SHA-256 of an input; of a log of several files it is inputs.common_hash of their hashes.

    Raises InputMissingError if a file cannot be read or is not a regular file, and the errors of files_of.
    """
    files = files_of(str(path)) if role == "log" else [str(path)]
    hashes = []
    for file in files:
        # Reading a named pipe would block for ever if nothing writes to it.
        if Path(file).exists() and not Path(file).is_file():
            raise InputMissingError(f"{file}: is not a file; name one")
        hashes.append(sha256_of(file))
    return hashes[0] if len(hashes) == 1 else common_hash(hashes)


def log_size(path: Path) -> int:
    """The size of all files of the log at `path`, bytes."""
    return sum(Path(file).stat().st_size for file in files_of(str(path)))


def inputs_and_parameters(entry: ManifestEntry, hashes: dict[str, str]) -> dict[str, Any]:
    """The inputs and parameters of a log, from which the next run tells what has changed."""
    inputs = {role: [path.name, hashes[role]] for role, path in entry.inputs.items()}
    return {"inputs": inputs, "parameters": entry.parameters.as_table()}


def fingerprint(entry: ManifestEntry, hashes: dict[str, str]) -> str:
    """The SHA-256 of everything that a log's results depend on; `hashes` has those of its inputs by role."""
    everything = {
        "tool": tool_key(),
        # Names of files count as well, since the results contain them.
        "inputs": {role: [path.name, hashes[role]] for role, path in entry.inputs.items()},
        "reading": dataclasses.asdict(entry.parameters.reading),
        "mapping": entry.parameters.mapping,
    }
    return hashlib.sha256(json.dumps(everything, sort_keys=True).encode()).hexdigest()
