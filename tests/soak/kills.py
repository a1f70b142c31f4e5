"""`nightly` killed at random moments: `python -m tests.soak.kills --kills 50 --seed 1`.

After every kill each file of the folder of nights is that of the night before or a new one, and whole; the
temporary files are those of the last run at most. The run after the last kill gives what an undisturbed one
gives. Exits with 1 otherwise.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from tests.nightly.small_logs import SCANS, results, write_logs

TEMPORARY = ".nscan-cli."
JOBS = 2


def start(manifest: Path, folder: Path, *more: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "nscan_cli", "nightly", str(manifest), "-o", str(folder), *more]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def files(folder: Path) -> Iterator[Path]:
    """Those that are no temporary ones."""
    for path in sorted(folder.rglob("*")):
        if path.is_file() and ".scratch" not in path.parts and not path.name.startswith("."):
            yield path


def faults(folder: Path) -> list[str]:
    """What is half-written."""
    found = []
    for path in files(folder):
        data = path.read_bytes()
        try:
            if path.suffix == ".json":
                json.loads(data)
            elif path.suffix == ".jsonl":
                [json.loads(line) for line in data.splitlines()]
            elif path.suffix == ".png":
                assert data.endswith(b"IEND\xaeB`\x82")
            elif path.suffix == ".html":
                assert data.rstrip().endswith(b"</html>")
        except (ValueError, AssertionError):
            found.append(f"{path}: {len(data)} bytes, not whole")
    return found


def main() -> int:
    """Kill, look, and run to the end."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak.kills", description=__doc__)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    moments, wrong, seen = random.Random(given.seed), [], Counter[str]()
    with tempfile.TemporaryDirectory(prefix="kills.") as name:
        manifest, folder, calm = write_logs(Path(name)), Path(name, "nights"), Path(name, "calm")
        began = time.monotonic()
        assert start(manifest, calm, "--jobs", str(JOBS), "-q").wait(300) == 0
        seconds = time.monotonic() - began
        most = 0
        for number in range(given.kills):
            # Nothing is up to date: every run has everything to do.
            process = start(manifest, folder, "--jobs", str(JOBS), "-q", *(["--force"] if number % 2 else []))
            time.sleep(moments.uniform(0.1, 1.1 * seconds))
            process.kill()
            process.communicate()
            seen["ended by itself" if process.returncode == 0 else "killed"] += 1
            time.sleep(0.5)
            wrong += faults(folder)
            most = max(most, sum(TEMPORARY in path.name for path in folder.rglob("*")))
        process = start(manifest, folder, "--jobs", str(JOBS), "-q", "--force")
        _, err = process.communicate(timeout=300)
        if process.returncode != 0:
            wrong.append(f"the run after: {process.returncode} {err.decode()}")
        left = [str(path) for path in folder.rglob("*") if TEMPORARY in path.name or path.name == ".scratch"]
        last, usual = results(folder), results(calm)
        differ = [key for key in usual if "nights" not in key and last.get(key) != usual[key]]
        extra = sorted(os.path.basename(key) for key in last.keys() - usual.keys())
    print(f"{dict(seen)}; a calm run takes {seconds:.1f} s; {len(SCANS)} logs")
    print(f"at most {most} temporary files after a kill, {len(left)} after the last run: {left}")
    print(
        f"{len(wrong)} faults, {len(differ)} files differ from those of a calm run: {differ}, more: {extra}"
    )
    for line in wrong:
        print(line)
    return 1 if wrong or left or differ else 0


if __name__ == "__main__":
    sys.exit(main())
