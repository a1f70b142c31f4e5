"""Commands in processes of their own: the processor's time that each took, and the most memory it held."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass

THREADS = {f"{library}_NUM_THREADS": "1" for library in ("OPENBLAS", "MKL", "OMP")}
LAUNCHER = """
import json, resource, subprocess, sys
code = subprocess.call(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(json.dumps([code, used.ru_utime + used.ru_stime, used.ru_maxrss]))
"""
"""Starts the command in between: what a process held when it started another counts for that one too."""


@dataclass(frozen=True)
class Used:
    """What a process took."""

    seconds: float
    """User and system time, which depends on what else the machine does far less than time by the clock."""
    megabytes: float
    """The greatest resident set, MB of 2²⁰ bytes."""


def run(arguments: Sequence[str]) -> Used:
    """Run `python arguments…` to its end, its output thrown away. Raises RuntimeError when it fails."""
    command = [sys.executable, *arguments]
    launcher = [sys.executable, "-I", "-S", "-c", LAUNCHER, *command]
    told = subprocess.run(launcher, env={**os.environ, **THREADS}, check=True, capture_output=True).stdout
    code, seconds, size = json.loads(told)
    if code != 0:
        raise RuntimeError(f"{' '.join(command)}: ended with {code}")
    unit = 1 if sys.platform == "darwin" else 1024
    return Used(seconds, size * unit / 2**20)
