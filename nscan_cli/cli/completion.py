"""Completion: of any names of files, and of `--option=value`, which zsh and fish take as one word.

click takes that as its value alone.
"""

from __future__ import annotations

import glob
import os
import sys
from collections.abc import Iterator

from click.shell_completion import (
    BashComplete,
    CompletionItem,
    FishComplete,
    ShellComplete,
    ZshComplete,
    add_completion_class,
)


class EncodedNames(str):
    """Text that becomes the bytes that the names in it have."""

    def encode(self, *_encoding: str) -> bytes:
        """As click does it for the shell; names that are no UTF-8 would stop it."""
        return super().encode(sys.getfilesystemencoding(), sys.getfilesystemencodeerrors())


class AnyNameComplete(ShellComplete):
    """What goes to the shell may be no UTF-8."""

    def complete(self) -> str:
        """The lines that the shell reads."""
        return EncodedNames(super().complete())


class WholeWordComplete(AnyNameComplete):
    """What completes a value stands behind its option again."""

    def get_completions(self, args: list[str], incomplete: str) -> list[CompletionItem[str]]:
        """How the word `incomplete`, which follows `args`, may go on."""
        option, joined, value = incomplete.partition("=")
        found = super().get_completions(args, incomplete)
        if not joined or not option.startswith("--"):
            return found
        return [
            CompletionItem(f"{option}={whole}", help=item.help)
            for item in found
            for whole in _expanded_values(item, value)
        ]


def _expanded_values(item: CompletionItem[str], value: str) -> Iterator[str]:
    """Those that an item stands for: shells look for files by a whole word, and would find none."""
    if item.type == "plain":
        yield item.value
        return
    for path in sorted(glob.glob(f"{glob.escape(value)}*")):
        yield os.path.join(path, "") if os.path.isdir(path) else path


class BashCompletion(AnyNameComplete, BashComplete):
    """Completion in bash."""


class ZshCompletion(WholeWordComplete, ZshComplete):
    """Completion in zsh."""


class FishCompletion(WholeWordComplete, FishComplete):
    """Completion in fish."""


def add_completions() -> None:
    """Let click complete so."""
    add_completion_class(BashCompletion)
    add_completion_class(ZshCompletion)
    add_completion_class(FishCompletion)
