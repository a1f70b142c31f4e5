"""One name, one meaning: no two public names and no two files of the package share one."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from tests.data import PACKAGE

PROTOCOLS = {
    "command": "the click command of a module in cli/",
    "main": "where a process begins",
    "read": "reads a text log; one for each form",
    "recognises": "whether a text is of this form; one for each form",
    "read_recording": "reads a recording; one for each container",
}
"""Names that several modules define because a caller asks each of them, and what they mean."""
FORMATS = {
    "carmen": "read in logs/text/, written in exports/",
    "mcap": "read in logs/recordings/, written in exports/",
    "pairwise": "matching/: pairwise matching; graph/relations/: the relation that it gives",
    "nscan": "cli/: the command; graph/relations/: the relation that it gives",
    "options": "the options of the package that it is in",
}
"""Stems of files that several packages have, and what they mean."""


def modules() -> Iterator[tuple[str, ast.Module]]:
    for path in sorted(PACKAGE.rglob("*.py")):
        yield path.relative_to(PACKAGE).as_posix(), ast.parse(path.read_text())


def defined(module: ast.Module) -> Iterator[str]:
    """Names of the classes, functions, types and constants that a module defines at its top."""
    for node in module.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            # A target may be a tuple of names.
            parts = (part for target in targets for part in ast.walk(target))
            yield from (part.id for part in parts if isinstance(part, ast.Name))


def several(places: dict[str, list[str]], allowed: dict[str, str]) -> dict[str, list[str]]:
    return {name: found for name, found in places.items() if len(found) > 1 and name not in allowed}


def test_a_public_name_has_one_meaning():
    places = defaultdict(list)
    for path, module in modules():
        for name in set(defined(module)):
            if not name.startswith("_"):
                places[name].append(path)
    assert several(places, PROTOCOLS) == {}
    assert all(len(places[name]) > 1 for name in PROTOCOLS)


def test_no_two_files_have_one_name():
    places = defaultdict(list)
    for path, _module in modules():
        if not path.endswith("__.py"):
            places[Path(path).stem].append(path)
    assert several(places, FORMATS) == {}
    assert {name for name in FORMATS if len(places[name]) < 2} == set()
