"""Completion of `--option=value`, which zsh and fish take as one word, and click as its value alone."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterator

from click.shell_completion import (
    CompletionItem,
    FishComplete,
    ShellComplete,
    ZshComplete,
    add_completion_class,
)


class WholeWords(ShellComplete):
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
            for whole in _values(item, value)
        ]


def _values(item: CompletionItem[str], value: str) -> Iterator[str]:
    """Those that an item stands for: shells look for files by a whole word, and would find none."""
    if item.type == "plain":
        yield item.value
        return
    for path in sorted(glob.glob(f"{glob.escape(value)}*")):
        yield os.path.join(path, "") if os.path.isdir(path) else path


class Zsh(WholeWords, ZshComplete):
    """Completion in zsh."""


class Fish(WholeWords, FishComplete):
    """Completion in fish."""


def complete_whole_words() -> None:
    """Let click complete so in both."""
    add_completion_class(Zsh)
    add_completion_class(Fish)
