"""The files that an input was read from, and the provenance in every result: tool, inputs, parameters."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, is_dataclass
from typing import Any

from nscan_cli import __version__


@dataclass(frozen=True)
class Source:
    """An input: one file, or several that belong together."""

    name: str
    """Its base name."""
    sha256: str
    """SHA-256 of the stored bytes; of several files, inputs.common_hash of theirs."""
    bytes: int
    """Its size."""
    parts: tuple[Source, ...] = ()
    """The files, if there are several."""

    @property
    def record(self) -> dict[str, Any]:
        """The input in the provenance of documents."""
        return {"name": self.name, "sha256": self.sha256, "bytes": self.bytes}

    @property
    def files(self) -> tuple[Source, ...]:
        """All files."""
        return self.parts or (self,)


def option_fields(options: Any) -> dict[str, Any] | None:
    """The fields of options, which are a dataclass or a named tuple; None for any other value."""
    if is_dataclass(options):
        return vars(options)
    return options._asdict() if hasattr(options, "_asdict") else None


def as_parameters(options: Any) -> Any:
    """Options, and those within them, as dicts of their fields; any other value as it is."""
    fields = option_fields(options)
    return options if fields is None else {name: as_parameters(each) for name, each in fields.items()}


def provenance_of(sources: Iterable[Source], parameters: dict[str, Any]) -> dict[str, Any]:
    """The tool with version, the inputs with base name, SHA-256 and size, and all parameters (m, rad)."""
    return {
        "tool": {"name": "nscan-cli", "version": __version__},
        "inputs": [file.record for source in sources for file in source.files],
        "parameters": parameters,
    }


def is_made_from(inputs: Sequence[dict[str, Any]], source: Source) -> bool:
    """Whether the inputs of a document are the files of this source, in any order."""
    return sorted(file["sha256"] for file in inputs) == sorted(file.sha256 for file in source.files)
