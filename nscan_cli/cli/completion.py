"""Shell completion of file names that are not UTF-8, and of `--option=value` in zsh and fish.

zsh and fish take `--option=value` as one word; click completes only the value.
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
    """Text that is encoded as file names are."""

    def encode(self, *_encoding: str) -> bytes:
        """Encode for the shell; UTF-8, which click asks for, fails for some names."""
        return super().encode(sys.getfilesystemencoding(), sys.getfilesystemencodeerrors())


class AnyNameComplete(ShellComplete):
    """Completion with names that need not be UTF-8."""

    def complete(self) -> str:
        """The completions as lines for the shell."""
        return EncodedNames(super().complete())


class WholeWordComplete(AnyNameComplete):
    """Completion of `--option=value` as one word."""

    def get_completions(self, args: list[str], incomplete: str) -> list[CompletionItem[str]]:
        """The completions of the word `incomplete`, which follows `args`."""
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
    """The values of an item. File names are listed here, since shells would look for the whole word."""
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
    """Register the classes with click."""
    add_completion_class(BashCompletion)
    add_completion_class(ZshCompletion)
    add_completion_class(FishCompletion)
