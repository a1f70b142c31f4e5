"""Two runs of the benchmarks: what has become slower, or takes more memory."""

from __future__ import annotations

Rows = dict[str, dict[str, float]]
"""By the name of the line: "ratio", and "megabytes" of a process."""
WORSE = 0.2
MEASURES = {"ratio": "time, measured by the workload's", "megabytes": "peak memory"}


def worse(now: Rows, before: Rows, share: float) -> list[str]:
    """A line for each measure that grew by more than a share; lines that one run alone has are left out."""
    lines = []
    for name in [name for name in now if name in before]:
        for key, what in MEASURES.items():
            new, old = now[name].get(key), before[name].get(key)
            if new is not None and old and new > (1 + share) * old:
                lines.append(f"{name}: {what} grew by {new / old - 1:.0%}, from {old:g} to {new:g}")
    return lines
