"""The names of pictures: a suffix has to be that of a format that is written."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from nscan_cli.errors import WrongUsageError
from nscan_cli.files.outputs import is_device

PICTURE_SUFFIXES = (".png",)
MAP_SUFFIXES = (".png", ".pgm")
PAGE_SUFFIXES = (".html", ".htm")
OTHER_SUFFIXES = (
    ".bmp", ".eps", ".gif", ".htm", ".html", ".jpeg", ".jpg", ".pdf", ".pgm", ".ppm", ".svg", ".tif",
    ".tiff", ".webp",
)  # fmt: skip


def check_suffix(place: str, path: str, written: Sequence[str] = PICTURE_SUFFIXES) -> None:
    """Raises WrongUsageError if the name of a picture has no suffix, or that of a format that is not written.

    `written` are the suffixes of the formats that are written. A suffix of no known format is accepted.
    """
    named = Path(path)
    what = "pictures are PNG" if len(written) == 1 else f"maps are {_listed(written)}"
    suffix = named.suffix.lower()
    if suffix in OTHER_SUFFIXES and suffix not in written:
        raise WrongUsageError(f"{place}: {what}; name it like {named.stem}.png")
    # check_writable refuses a folder with its own message.
    is_file = path != "-" and not is_device(path) and not os.path.isdir(path) and named.name
    if is_file and not named.suffix:
        name = named.with_name(f"{named.name.strip('.') or 'map'}.png")
        raise WrongUsageError(f"{place}: the name has no suffix; {what}: name it {name}")


def is_page(path: str) -> bool:
    """Whether the name of a map is that of a page for browsers."""
    return Path(path).suffix.lower() in PAGE_SUFFIXES


def _listed(suffixes: Sequence[str]) -> str:
    """The formats of suffixes: "PNG or PGM"."""
    *others, last = (suffix.lstrip(".").upper() for suffix in suffixes)
    return f"{', '.join(others)} or {last}"
