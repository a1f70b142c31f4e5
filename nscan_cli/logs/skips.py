"""Records of a log that were skipped, with the reasons."""

from __future__ import annotations

from dataclasses import dataclass, field

from nscan_cli.errors import InputDataError


@dataclass
class Skips:
    """Skipped records by reason. If `strict`, the first one raises an error."""

    file: str
    strict: bool
    place: str = "line"
    """What the numbers count: "line" of a text, or "message" of a topic in a recording."""
    reasons: dict[str, tuple[int, int]] = field(default_factory=dict)
    """Number of records and the place of the first, by reason."""

    def add(self, reason: str, number: int) -> None:
        """Count a record at place `number`. Raises InputDataError if `strict`."""
        if self.strict:
            if self.place == "line":
                raise InputDataError(self.file, reason, "correct the line, or leave out --strict", number)
            raise InputDataError(self.file, f"{self.place} {number}: {reason}", "leave out --strict")
        count, first = self.reasons.get(reason, (0, number))
        self.reasons[reason] = (count + 1, min(first, number))

    def nothing_read(self, records: str) -> InputDataError:
        """The error for a text log of whose `records`, such as "laser:0 record", all were skipped."""
        reason, (_, first) = next(iter(self.reasons.items()))
        problem = f"no {records} can be read: {reason}"
        return InputDataError(self.file, problem, "give a log with whole records", first)
