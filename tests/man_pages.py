"""The man pages, made from the commands themselves as docs/reference.md is (tests/reference.py).

One page for `nscan-cli` and one for each command, in the macros of man(7). The wheel installs them.
"""

from __future__ import annotations

from collections.abc import Iterable

import click

from nscan_cli import __version__
from nscan_cli.cli.main import ALIASES, COMMANDS, cli
from nscan_cli.cli.manual import ENVIRONMENT, EXAMPLES, EXIT_CODES
from nscan_cli.cli.subcommand import CONTEXT, SECTIONS, Example, Subcommand

PARENT = click.Context(cli, info_name="nscan-cli")


def man_pages() -> dict[str, str]:
    """The name of each page's file, and its text."""
    return {"nscan-cli.1": _whole(), **{f"nscan-cli-{name}.1": _page(name) for name in COMMANDS}}


def _whole() -> str:
    listed = _items((f"nscan-cli-{name}(1)", about) for name, about in COMMANDS.items())
    aliases = " ".join(f"{alias} is {name}." for alias, name in ALIASES.items())
    return "".join(
        [
            _head("nscan-cli", "map 2D laser logs by nScan-Matching"),
            _section("SYNOPSIS", "nscan-cli COMMAND [OPTIONS] ARGUMENTS"),
            _section("DESCRIPTION", _paragraphs(cli.help or "")),
            _section("COMMANDS", listed + _text(aliases)),
            _ends(EXAMPLES),
        ]
    )


def _page(name: str) -> str:
    command = cli.get_command(PARENT, name)
    assert isinstance(command, Subcommand)
    context = click.Context(command, info_name=name, parent=PARENT, **CONTEXT)
    usage = command.get_usage(context).removeprefix("Usage: ")
    parts = [
        _head(f"nscan-cli-{name}", COMMANDS[name].rstrip(".")),
        _section("SYNOPSIS", usage),
        _section("DESCRIPTION", _paragraphs(command.help or "")),
    ]
    for title in SECTIONS:
        if records := command.records(context, title):
            parts.append(_section(title.upper(), _items(records)))
    return "".join([*parts, _ends(command.examples)])


def _ends(examples: Iterable[Example]) -> str:
    """What all pages end with."""
    lines = "".join(f".PP\n{_text(purpose)}\n.PP\n.EX\n{_text(line)}\n.EE\n" for line, purpose in examples)
    codes = _items((str(code), meaning) for code, meaning in EXIT_CODES.items())
    return (
        _section("EXAMPLES", lines)
        + _section("EXIT STATUS", codes)
        + _section("ENVIRONMENT", _items(ENVIRONMENT.items()))
    )


def _head(name: str, about: str) -> str:
    return f'.TH "{name.upper()}" "1" "" "nscan-cli {__version__}"\n' + _section(
        "NAME", f"{_text(name)} \\- {_text(about[:1].lower() + about[1:])}"
    )


def _section(title: str, text: str) -> str:
    return f'.SH "{title}"\n{text.rstrip()}\n'


def _items(records: Iterable[tuple[str, str]]) -> str:
    return "".join(f".TP\n\\fB{_text(name)}\\fR\n{_text(about)}\n" for name, about in records)


def _paragraphs(text: str) -> str:
    return ".PP\n".join(_text(" ".join(part.split())) + "\n" for part in text.split("\n\n"))


def _text(text: str) -> str:
    """Text without what roff takes for its own: backslashes, dashes, a point at the beginning."""
    escaped = text.replace("\\", "\\e").replace("-", "\\-")
    return f"\\&{escaped}" if escaped[:1] in (".", "'") else escaped
