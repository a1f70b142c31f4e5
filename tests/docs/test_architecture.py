"""docs/architecture.md: every equation of the paper leads to a function that is there and says so."""

from __future__ import annotations

import ast
import itertools
import re
from pathlib import Path

import pytest

from tests.data import PACKAGE, REPOSITORY
from tests.docs.blocks import blocks

PAGE = (REPOSITORY / "docs" / "architecture.md").read_text()
ROW = re.compile(
    r"^\| (\(\d[^|]*|III[^|]*|V[^|]*) \| [^|]+ \| \[([\w/.]+)\]\(([^)]+)\) \| `(\w+)` \|$", re.MULTILINE
)
ROWS = ROW.findall(PAGE)
PICTURE = blocks("docs/architecture.md", "mermaid")[0]
ARROW = re.compile(r"\s*(?:-->|-- .*? -->|-\. .*? \.->)\s*")
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
    assert (REPOSITORY / "docs" / link).resolve() == PACKAGE / name
    assert function in functions(PACKAGE / name)


def test_what_the_code_says_of_equations_is_in_the_table():
    """A module that names an equation in a docstring or a comment is one that its row leads to."""
    led_to: dict[str, set[int]] = {}
    for equation, name, _link, _function in ROWS:
        led_to.setdefault(name, set()).update(numbers(equation))
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        if name.startswith(("matching/", "graph/", "poses")):
            named = set().union(*(numbers(match) for match in NAMED.findall(path.read_text())))
            elsewhere = led_to.get(name) or set().union(*led_to.values())
            assert named <= elsewhere, name


def test_the_picture_names_the_packages_that_there_are():
    packages = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    inner = {path.parent.name for path in PACKAGE.glob("*/*/__init__.py")}
    drawn = set(re.findall(r"\b(\w+)/", PICTURE))
    assert drawn <= packages | inner
    assert packages - drawn == {"cli", "files", "kernels", "nightly", "warm_up"}
    for module in re.findall(r"\b(\w+\.py)", PICTURE):
        assert list(PACKAGE.rglob(module)), module


def imports() -> set[tuple[str, str]]:
    """(a, b) where package a imports of package b; a module beside the packages stands for itself."""
    found = set()
    for path in PACKAGE.rglob("*.py"):
        importer = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
        for node in ast.walk(ast.parse(path.read_text())):
            names: list[str] = []
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [f"{node.module}.{alias.name}" for alias in node.names]
            elif isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            for name in names:
                top, _, rest = name.partition(".")
                if top == "nscan_cli" and rest.partition(".")[0] != importer:
                    found.add((importer, rest.partition(".")[0]))
    return found


def test_imports_go_one_way():
    """In the order that CONTRIBUTING.md gives."""
    (line,) = re.findall(r"Imports go one way: ([\w → ]+);", (REPOSITORY / "CONTRIBUTING.md").read_text())
    order = {name: rank for rank, name in enumerate(line.split(" → "))}
    packages = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert order.keys() == packages
    for importer, imported in imports():
        if imported in packages and importer != "__main__":
            # Of the modules beside the packages, the public functions are on top of all but the commands.
            # The others take types at most, of what a log is.
            rank = order["cli"] if importer in ("api", "__init__") else order.get(importer, 1)
            assert order[imported] < rank, f"{importer} imports {imported}"


def drawn_between_packages() -> set[tuple[str, str]]:
    """(a, b) where an arrow of the picture goes from a node of package a to one of package b."""
    package = dict(re.findall(r'(\w+)\["<b>(\w+)/</b>', PICTURE))
    inside = PICTURE.partition("subgraph")[2].partition("\n    end")[0]
    package |= dict.fromkeys(re.findall(r'^ +(\w+)\["', inside, re.MULTILINE), "slam")
    found = set()
    for line in PICTURE.splitlines():
        groups = [re.findall(r"(?:^|& )\s*(\w+)", part) for part in ARROW.split(line.strip())]
        for sources, targets in itertools.pairwise(groups):
            found |= {
                (package[source], package[target])
                for source in sources
                for target in targets
                if source in package and target in package and package[source] != package[target]
            }
    return found


def test_the_picture_is_true_to_the_imports():
    """Of two packages with an arrow between them one imports the other, and the other way round.

    Types of a log travel with everything and are drawn where scans do. Graphs and results reach others as
    files or by a caller, whose arrows begin in slam/: who takes them imports graph/. Of matching/, graph/
    uses the control of Newton steps alone, which is no data.
    """
    real = {frozenset(pair) for pair in imports()}
    drawn = {frozenset(pair) for pair in drawn_between_packages()}
    by_callers = {frozenset(("slam", taker)) for taker in ("mapping", "exports")}
    assert by_callers <= drawn
    assert drawn - by_callers <= real
    packages = set().union(*drawn)
    untold = {pair for pair in real - drawn if pair <= packages and "logs" not in pair}
    assert untold == {
        frozenset(("graph", other)) for other in ("mapping", "exports", "evaluation", "matching")
    }


def test_the_modules_beside_the_packages_are_named():
    beside = {path.name for path in PACKAGE.glob("*.py") if not path.name.startswith("__")}
    assert beside == {name for name in re.findall(r"`(\w+\.py)`", PAGE) if (PACKAGE / name).exists()}


def test_every_module_says_what_it_is():
    for path in PACKAGE.rglob("*.py"):
        if path.name != "__main__.py":
            told = ast.get_docstring(ast.parse(path.read_text()))
            assert told, path
            assert told.partition("\n")[0].endswith((".", ":", ")")), path
