"""What the scans contradict of the clocks, as sentences."""

from __future__ import annotations

from nscan_cli.calibration.clock_offset import ClockOffset
from nscan_cli.calibration.findings import Finding
from nscan_cli.logs.reading_options import ReadingOptions


def two_clocks(found: ClockOffset, reading: ReadingOptions) -> Finding:
    """Odometry is stamped by another clock."""
    side = "behind" if found.offset > 0 else "ahead of"
    return Finding(
        f"the clock of odometry is likely {abs(found.offset):.1f} s {side} that of the scans: with this "
        f"offset their turns differ by {found.disagreement:.0%}, as stamped by {found.as_stamped:.0%}; "
        f"try --clock-offset {reading.clock_offset + found.offset:.1f}",
        clock_offset=found.offset,
        is_of_clocks=True,
    )
