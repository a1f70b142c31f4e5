"""The pictures of README and docs that show the tool at work: `python -m tests.pictures FOLDER`.

Drawn by the commands that the pages show. Those of the real logs are left as they are where NSCAN_DATA does
not have them.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from tests.data import OFFICE_LOG, find_data
from tests.experiments.output import small_png

if TYPE_CHECKING:
    from PIL.Image import Image

PAIR_WIDTH = 1600
"""Pixels of two maps beside each other."""
TURNING_LASERS: dict[str, tuple[str, ...]] = {
    "rplidar-floor": (),
    "rplidar-hallway.bag": (),
    "neato.bag": ("--topic", "/stable_scan"),
    "urg-corridor-1.bag": (),
    "urg-corridor-2.bag": (),
    "urg-carried.bag": (),
}
"""Recordings of lasers that turn, and the options to read them with."""


def main(folder: str) -> None:
    """Draw all pictures that can be drawn into an existing folder."""
    with tempfile.TemporaryDirectory() as scratch:
        drawn = _of_the_sample(Path(scratch)), _of_real_logs(Path(scratch)), _of_turning_lasers(Path(scratch))
        for name, picture in {name: each for some in drawn for name, each in some.items()}.items():
            width = PAIR_WIDTH if name.endswith(("-loops", "-turn", "-clean")) else None
            (Path(folder) / f"{name}.png").write_bytes(small_png(picture, width))
            print(f"{name}.png")


def _run(*arguments: str | Path) -> None:
    subprocess.run([sys.executable, "-m", "nscan_cli", *map(str, arguments), "-q"], check=True)


def _opened(path: Path) -> Image:
    from PIL import Image

    with Image.open(path) as picture:
        return picture.convert("RGB")


def _of_the_sample(scratch: Path) -> dict[str, Image]:
    graph, drawn, plot = scratch / "office.json", scratch / "office.png", scratch / "match.png"
    _run("slam", OFFICE_LOG, "-o", graph)
    _run("render", graph, OFFICE_LOG, "-o", drawn, "--trajectory", "--graph")
    scans = ["--reference", "2000", "--scan", "2008", "--initial", "0.6,0.4,12", "--prior", "none"]
    _run("match", OFFICE_LOG, *scans, "-o", scratch / "match.json", "--plot", plot)
    return {"office": _opened(drawn), "match": _opened(plot)}


def _of_real_logs(scratch: Path) -> dict[str, Image]:
    pictures = {}
    for name in ("intel", "mit-killian", "fr-campus"):
        log = find_data(f"{name}.log.gz")
        if log is None:
            continue
        closed = _map(log, scratch)
        if name != "fr-campus":
            pictures[name] = closed
        if name == "intel":
            pictures["intel-clean"] = _cleaned(log, scratch)
        if name != "intel":
            pictures[f"{name}-loops"] = _beside(_map(log, scratch, "--no-loops"), closed)
        else:
            plot = scratch / "nscan.png"
            _run("nscan", log, "--scans", "3000-3090:10", "-o", scratch / "nscan.json", "--plot", plot)
            pictures["nscan"] = _opened(plot)
    return pictures


def _of_turning_lasers(scratch: Path) -> dict[str, Image]:
    """Each as if the laser saw at once, and with every beam from where the robot was."""
    pictures = {}
    for name, options in TURNING_LASERS.items():
        log = find_data(f"field/{name}")
        if log is not None:
            at_once = _map(log, scratch, "--sweep", "off", *options)
            pictures[f"{log.stem}-turn"] = _beside(at_once, _map(log, scratch, *options))
    return pictures


def _map(log: Path, scratch: Path, *options: str) -> Image:
    graph, drawn = scratch / "map.json", scratch / "map.png"
    _run("slam", log, "-o", graph, *options)
    _run("render", graph, log, "-o", drawn, "--style", "paper", "--trajectory")
    return _opened(drawn)


def _cleaned(log: Path, scratch: Path) -> Image:
    """The map of the graph that `_map` has made, and what --clean leaves of it."""
    graph, plain, clean = scratch / "map.json", scratch / "plain.png", scratch / "clean.png"
    _run("render", graph, log, "-o", plain, "--align", "--crop", "auto")
    _run("render", graph, log, "-o", clean, "--align", "--crop", "auto", "--clean")
    return _beside(_opened(plain), _opened(clean))


def _beside(left: Image, right: Image) -> Image:
    """Both at the height of the lower one, on white."""
    from PIL import Image

    height = min(left.height, right.height)
    parts = [
        part.resize((round(part.width * height / part.height), height), Image.Resampling.LANCZOS)
        for part in (left, right)
    ]
    both = Image.new("RGB", (parts[0].width + parts[1].width, height), "white")
    both.paste(parts[0], (0, 0))
    both.paste(parts[1], (parts[0].width, 0))
    return both


if __name__ == "__main__":
    main(sys.argv[1])
