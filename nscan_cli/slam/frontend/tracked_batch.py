"""Scans of one track segment with where tracking found them: what the stages after tracking receive."""

from __future__ import annotations

from dataclasses import dataclass

from nscan_cli.slam.frontend.scan_batch import ScanBatch
from nscan_cli.slam.frontend.tracked_scans import TrackedScans


@dataclass(frozen=True)
class TrackedBatch:
    """Scans of one track segment, and where tracking found them."""

    scans: ScanBatch
    tracked: TrackedScans
    starts_segment: bool = False
    """Whether a new segment starts with the first of the scans."""
    after_break: bool = False
    """Whether the track broke before it: the motion to there is unknown."""

    def __len__(self) -> int:
        return len(self.scans)

    def part(self, first: int, end: int) -> TrackedBatch:
        """The scans from the `first` on, before the `end`."""
        scans, tracked = self.scans.part(first, end), self.tracked.part(first, end)
        return TrackedBatch(
            scans, tracked, self.starts_segment and first == 0, self.after_break and first == 0
        )

    def one(self, k: int) -> TrackedBatch:
        """One of the scans; counted from the end if k is negative."""
        k %= len(self)
        return self.part(k, k + 1)
