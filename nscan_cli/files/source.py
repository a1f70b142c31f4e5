"""The files that an input was read from."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Source:
    """One file, or several that form one input: base name, SHA-256 of the stored bytes, size in bytes.

    The SHA-256 of several files is inputs.common_hash of theirs.
    """

    name: str
    sha256: str
    bytes: int
    parts: tuple[Source, ...] = ()
    """The files, if there are several."""

    @property
    def files(self) -> tuple[Source, ...]:
        """All files."""
        return self.parts or (self,)
