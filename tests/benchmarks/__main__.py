"""Times what matters against a fixed workload, all in one run: `python -m tests.benchmarks [OUT.json]`."""

from __future__ import annotations

import json
import sys
from itertools import chain
from pathlib import Path

from tests.benchmarks import matching, reading
from tests.benchmarks.clock import best_of, workload


def main(out: str | None) -> None:
    """Print the table; write it as JSON if asked."""
    unit = best_of(workload, 20)
    print(f"{'workload':<48}{unit:>10.2f} ms{'ratio':>9}")
    rows = {}
    for timing in chain(matching.timings(), reading.timings()):
        ratio = timing.milliseconds / unit
        rows[timing.name] = {"milliseconds": round(timing.milliseconds, 3), "ratio": round(ratio, 4)}
        print(f"{timing.name:<48}{timing.milliseconds:>10.2f} ms{ratio:>9.3f}")
    if out is not None:
        Path(out).write_text(json.dumps({"workload": round(unit, 3), "timings": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else None)
