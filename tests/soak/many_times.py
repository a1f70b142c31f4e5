"""A CARMEN log many times over as one: `python -m tests.soak.many_times LOG TIMES > OUT`.

The end is joined to the start: stamps and odometry are carried on. Where the robot did not end where it
began, it is as if someone had carried it back. LOG may be compressed by gzip.
"""

from __future__ import annotations

import gzip
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from nscan_cli.poses import Array, compose, relative


def many_times(text: str, times: int) -> Iterator[str]:
    """The lines of the log; those other than FLASER once, as far as they come before the first scan."""
    lines = text.splitlines()
    scans = [line.split() for line in lines if line.startswith("FLASER ")]
    first = next(at for at, line in enumerate(lines) if line.startswith("FLASER "))
    yield from (line for line in lines[:first] if line.startswith(("#", "PARAM")))
    stamps = np.array([float(scan[-3]) for scan in scans])
    poses = np.array([[float(value) for value in scan[-6:-3]] for scan in scans])
    mounts = [
        relative(np.array([float(value) for value in scan[-9:-6]]), p)
        for scan, p in zip(scans, poses, strict=True)
    ]
    lasts = stamps.max() - stamps.min() + float(np.median(np.diff(stamps)))
    origin: Array = poses[0]
    for turn in range(times):
        carried = compose(origin, relative(poses, poses[0]))
        for scan, pose, mount, stamp in zip(scans, carried, mounts, stamps, strict=True):
            laser = compose(pose, mount)
            said = [f"{value:.6f}" for value in (*laser, *pose)]
            yield " ".join([*scan[:-9], *said, f"{stamp + turn * lasts:.6f}", *scan[-2:]])
        origin = carried[-1]


def main(log: str, times: str) -> None:
    """Write the lines to standard output."""
    data = Path(log).read_bytes()
    text = gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data
    for line in many_times(text.decode("ascii", errors="replace"), int(times)):
        print(line)


if __name__ == "__main__":
    main(*sys.argv[1:])
