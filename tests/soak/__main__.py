"""Damaged input for every reader and for whole runs, within a time that is given.

    python -m tests.soak --seconds 120 --runs 60 --seed 1

Prints how often which outcome was met; a fault (any other exception, a hang, too much memory, an exit
code that is not promised) is written to the folder --faults together with its input. Exits with 1 then.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tests.soak import read_all, run_all


def main() -> int:
    """Run both parts and print their tables."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak", description=__doc__)
    parser.add_argument("--seconds", type=float, default=120, help="for the readers")
    parser.add_argument("--runs", type=float, default=60, help="seconds for whole runs")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--faults", type=Path, default=Path("out/soak"))
    given = parser.parse_args()
    given.faults = given.faults.absolute()
    given.faults.mkdir(parents=True, exist_ok=True)
    faults = 0
    print(f"seed {given.seed}")
    for title, part, seconds in (("inputs read", read_all, given.seconds), ("runs", run_all, given.runs)):
        if seconds > 0:
            counts, found = part.soak(seconds, given.seed, given.faults)
            print(f"{sum(counts.values()):,} {title}, {found} faults")
            for (form, what), count in sorted(counts.items()):
                print(f"  {count:8,}  {form}: {what}")
            faults += found
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
