"""Reports as files: pictures small enough to be read on a page, and one Markdown document."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tests.experiments.report import Report

if TYPE_CHECKING:
    from PIL.Image import Image

WIDTH, HEIGHT = 1000, 1300
"""Pixels of a picture at most."""
COLOURS = 128
"""Of its palette."""
COMMAND = "make figures"


def write_reports(reports: Sequence[Report], folder: Path) -> list[Path]:
    """Write the pictures into an existing folder, and experiments.md beside it. Returns all their paths."""
    paths = []
    for report in reports:
        for name, picture in report.pictures.items():
            paths.append(folder / f"{name}.png")
            paths[-1].write_bytes(small_png(picture))
    paths.append(folder.resolve().parent / "experiments.md")
    paths[-1].write_text(document(reports, folder.resolve().name), encoding="utf-8")
    return paths


def small_png(picture: Image, width: int | None = None) -> bytes:
    """A picture reduced to the size of a page, or to another width, with a palette."""
    from PIL import Image

    factor = min((width or WIDTH) / picture.width, HEIGHT / picture.height)
    size = (round(factor * picture.width), round(factor * picture.height))
    small = picture.resize(size, Image.Resampling.LANCZOS)
    # The median cut would drop colours that only a few pixels have.
    palette = small.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=3, dither=Image.Dither.NONE)
    file = io.BytesIO()
    palette.save(file, "PNG", optimize=True)
    return file.getvalue()


def document(reports: Sequence[Report], folder: str) -> str:
    """All reports as Markdown; `folder` is where the pictures are, as seen from the document."""
    parts = [
        "# The paper's experiments, repeated",
        f"Written by `{COMMAND}`; the same figures every time. The paper is P. Biber, W. Straßer, "
        '"nScan-Matching: Simultaneous Matching of Multiple Scans and Application to SLAM", ICRA 2006.',
    ]
    for report in reports:
        parts += [f"## {report.title}", report.text]
        parts += [f"![{report.title}]({folder}/{name}.png)" for name in report.pictures]
        parts += [table(report.header, report.rows), *report.left_out]
    return "\n\n".join(parts) + "\n"


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
