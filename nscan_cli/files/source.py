"""What an input was read from: one file, or several that belong together."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Source:
    """What an input was read from: base name, SHA-256 of its bytes as stored, size in bytes.

    Several files are one source: its SHA-256 is then inputs.common_hash of theirs.
    """

    name: str
    sha256: str
    bytes: int
    parts: tuple[Source, ...] = ()
    """The files, where there are several."""

    @property
    def files(self) -> tuple[Source, ...]:
        """Each file."""
        return self.parts or (self,)
