"""docs/architecture.md: every equation of the paper leads to a function that is there and says so."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from tests.docs.blocks import ROOT, blocks

PACKAGE = ROOT / "nscan_cli"
PAGE = (ROOT / "docs" / "architecture.md").read_text()
ROW = re.compile(
    r"^\| (\(\d[^|]*|III[^|]*|V[^|]*) \| [^|]+ \| \[([\w/.]+)\]\(([^)]+)\) \| `(\w+)` \|$", re.MULTILINE
)
ROWS = ROW.findall(PAGE)
NAMED = re.compile(r"\beqs?\. ((?:\(\d+\)(?:, | and | to )?)+)", re.IGNORECASE)


def numbers(text: str) -> set[int]:
    """The equations of "(6), (7)" or "(18) to (22)"."""
    found = {int(number) for number in re.findall(r"\((\d+)\)", text)}
    for first, last in re.findall(r"\((\d+)\) to \((\d+)\)", text):
        found |= set(range(int(first), int(last) + 1))
    return found


def functions(path: Path) -> set[str]:
    tree = ast.parse(path.read_text())
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


def test_every_equation_is_in_the_table():
    table = set().union(*(numbers(equation) for equation, *_rest in ROWS))
    assert table == set(range(1, 26))
    assert len(ROWS) == len(re.findall(r"\| `\w+` \|$", PAGE, re.MULTILINE))


@pytest.mark.parametrize(("what", "name", "link", "function"), ROWS, ids=lambda value: str(value)[:30])
def test_the_function_is_there(what, name, link, function):
    assert (PACKAGE.parent / "docs" / link).resolve() == PACKAGE / name
    assert function in functions(PACKAGE / name)


def test_what_the_code_says_of_equations_is_in_the_table():
    """A module that names an equation in a docstring or a comment is one that its row leads to."""
    led_to: dict[str, set[int]] = {}
    for equation, name, _link, _function in ROWS:
        led_to.setdefault(name, set()).update(numbers(equation))
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        if name.startswith(("matching/", "graph/terms", "graph/system", "poses")):
            named = set().union(*(numbers(match) for match in NAMED.findall(path.read_text())))
            elsewhere = led_to.get(name) or set().union(*led_to.values())
            assert named <= elsewhere, name


def test_the_picture_names_the_packages_that_there_are():
    (picture,) = blocks("docs/architecture.md", "mermaid")
    packages = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    drawn = set(re.findall(r"\b(\w+)/", picture))
    assert drawn <= packages
    assert packages - drawn == {"cli", "nightly"}
    for module in re.findall(r"\b(\w+\.py)", picture):
        assert list(PACKAGE.glob(f"*/{module}")), module


def test_every_module_says_what_it_is():
    for path in PACKAGE.rglob("*.py"):
        if path.name != "__main__.py":
            told = ast.get_docstring(ast.parse(path.read_text()))
            assert told, path
            assert told.partition("\n")[0].endswith((".", ":", ")")), path
