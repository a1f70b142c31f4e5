"""The code blocks of a Markdown page."""

from __future__ import annotations

import re

from tests.data import REPOSITORY

BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(page: str, *kinds: str) -> list[str]:
    """The contents of a page's blocks of these kinds, in order."""
    return [text for kind, text in BLOCK.findall((REPOSITORY / page).read_text()) if kind in kinds]
