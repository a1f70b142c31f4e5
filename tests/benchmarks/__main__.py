"""Times what matters against a fixed workload, all in one run: `python -m tests.benchmarks [OUT.json]`.

`--against OLD.json` compares the ratios with those of an earlier run, and exits with 3 when one is worse by
more than the share `--worse` allows. `--only TEXT` measures the lines with that in their group's name.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from tests.benchmarks import commands, matching, peers, reading
from tests.benchmarks.clock import best_of, workload
from tests.benchmarks.compare import WORSE, Rows, worse

GROUPS = {"peers": peers, "reading": reading, "matching": matching, "commands": commands}
REGRESSION = 3


def main() -> int:
    """Print the table; write it as JSON if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", nargs="?")
    parser.add_argument("--against", metavar="OLD.json")
    parser.add_argument("--worse", type=float, default=WORSE, help="share, %(default)s by default")
    parser.add_argument("--only", choices=list(GROUPS), action="append")
    options = parser.parse_args()
    rows: Rows = {}
    print(f"{'':<52}{'CPU, ms':>12}{'ratio':>11}{'RSS, MB':>9}")
    for name in options.only or GROUPS:
        for timing in GROUPS[name].timings():
            # The workload again each time: a machine is not as fast in one minute as in the next.
            ratio = timing.milliseconds / best_of(workload, 10)
            rows[timing.name] = {"milliseconds": round(timing.milliseconds, 3), "ratio": round(ratio, 4)}
            memory = ""
            if timing.megabytes is not None:
                rows[timing.name]["megabytes"] = round(timing.megabytes, 1)
                memory = f"{timing.megabytes:.0f}"
            print(f"{timing.name:<52}{timing.milliseconds:>12.2f}{ratio:>11.3f}{memory:>9}", flush=True)
    if options.out is not None:
        document = {"workload": round(best_of(workload, 20), 3), "timings": rows}
        Path(options.out).write_text(json.dumps(document, indent=1) + "\n")
    if options.against is None:
        return 0
    regressions = worse(rows, json.loads(Path(options.against).read_text())["timings"], options.worse)
    for line in regressions:
        print(line)
    return REGRESSION if regressions else 0


if __name__ == "__main__":
    sys.exit(main())
