"""The names of pictures, whose suffix is that of a format that is written, and of documents."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from nscan_cli.errors import WrongUsageError
from nscan_cli.files.outputs import is_device
from nscan_cli.files.text import listed

PICTURE_SUFFIXES = (".png",)
MAP_SUFFIXES = (".png", ".pgm")
MAP_OR_PAGE_SUFFIXES = (*MAP_SUFFIXES, ".html")
PAGE_SUFFIXES = (".html", ".htm")
ALL_SUFFIXES = (
    ".bmp", ".eps", ".gif", ".htm", ".html", ".jpeg", ".jpg", ".pdf", ".pgm", ".png", ".ppm", ".svg", ".tif",
    ".tiff", ".webp",
)  # fmt: skip
"""Suffixes of pictures and pages, also of formats that are not written."""


def check_suffix(place: str, path: str, written: Sequence[str] = PICTURE_SUFFIXES) -> None:
    """Raises WrongUsageError if the name of a picture has no suffix, or none of `written`."""
    named = Path(path)
    formats = listed([suffix.lstrip(".").upper() for suffix in written], "or")
    what = f"{'pictures' if len(written) == 1 else 'maps'} are {formats}"
    # check_writable refuses a folder with its own message.
    if path == "-" or is_device(path) or os.path.isdir(path) or not named.name:
        return
    if named.suffix and named.suffix.lower() not in written:
        raise WrongUsageError(f"{place}: {what}; name it like {named.stem}.png")
    if not named.suffix:
        name = named.with_name(f"{named.name.strip('.') or 'map'}.png")
        raise WrongUsageError(f"{place}: the name has no suffix; {what}: name it {name}")


def check_document_name(path: str, what: str, remedy: str) -> None:
    """Raises WrongUsageError if the name of a document, which is `what`, is that of a picture or a page."""
    if Path(path).suffix.lower() in ALL_SUFFIXES and not is_device(path):
        raise WrongUsageError(f"{path}: has the name of a picture, but is {what}; {remedy}")


def is_page(path: str) -> bool:
    """Whether the name of a map is that of a page for browsers."""
    return Path(path).suffix.lower() in PAGE_SUFFIXES
