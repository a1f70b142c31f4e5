"""Numbers of things in messages: 1 scan, 2 scans."""

from __future__ import annotations


def counted(count: int, thing: str) -> str:
    """The count and the name of the thing, in the plural unless the count is 1."""
    if count == 1:
        return f"1 {thing}"
    return f"{count} {thing}{'es' if thing.endswith(('s', 'x', 'ch', 'sh')) else 's'}"
