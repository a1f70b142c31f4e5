"""Records of a log that were left out, and why."""

from __future__ import annotations

from dataclasses import dataclass, field

from nscan_cli.errors import InputDataError


@dataclass
class Skips:
    """Records that were left out, by reason; under `strict` the first one is an error."""

    file: str
    strict: bool
    place: str = "line"
    """What the numbers count: "line" of a text, or "message" of a topic in a recording."""
    reasons: dict[str, tuple[int, int]] = field(default_factory=dict)

    def add(self, reason: str, number: int) -> None:
        """Count one record. Raises InputDataError under strict."""
        if self.strict:
            if self.place == "line":
                raise InputDataError(self.file, reason, "mend the line, or leave out --strict", number)
            raise InputDataError(self.file, f"{self.place} {number}: {reason}", "leave out --strict")
        count, first = self.reasons.get(reason, (0, number))
        self.reasons[reason] = (count + 1, min(first, number))
