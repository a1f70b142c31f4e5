"""One of a thing is named as one."""

from __future__ import annotations

import ast
import itertools
import re

import pytest

from nscan_cli.files.counting import counted
from tests.data import PACKAGE


@pytest.mark.parametrize(
    ("count", "thing", "said"),
    [
        (0, "scan", "0 scans"),
        (1, "scan", "1 scan"),
        (2, "scan", "2 scans"),
        (1, "search", "1 search"),
        (13631, "search", "13631 searches"),
        (2, "time stamp", "2 time stamps"),
    ],
)
def test_counted(count, thing, said):
    assert counted(count, thing) == said


THINGS = re.compile(
    r" (scans|records|messages|iterations|evaluations|keyframes|poses|loops|pairs|steps|stamps)\b"
)

NEVER_ONE = {
    ("cli/nightly_progress.py", " scans, "): "so many of so many",
    ("cli/scan_spec.py", " scans"): "a limit",
    ("cli/slam.py", " scans a second, "): "a rate",
    ("evaluation/evaluation_report.py", " poses match within "): "a trajectory is aligned by several",
    ("graph/io/json_fields.py", " poses of three "): "of a joint relation",
    ("logs/assemble.py", " scans of up to "): "beyond a limit",
    ("logs/text/carmen.py", " records"): "a tag",
    ("logs/text/carmen.py", " scans; --laser can be "): "a tag",
    ("logs/text/corrected_poses.py", " records"): "a tag",
    ("logs/recordings/mcap.py", " messages on "): "so many of so many",
    ("mapping/figures/match_plots.py", " scans, least overlap "): "of a joint match",
    ("slam/local_matching/joint_relations.py", " scans hang together"): "so many of so many",
}


def uncounted() -> set[tuple[str, str]]:
    """The file and the text after a number, wherever a message has a thing in the plural there."""
    found = set()
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.JoinedStr):
                for value, text in itertools.pairwise(node.values):
                    after = str(text.value) if isinstance(text, ast.Constant) else ""
                    if isinstance(value, ast.FormattedValue) and THINGS.match(after):
                        found.add((path.relative_to(PACKAGE).as_posix(), after))
    return found


def test_no_message_counts_by_itself_what_there_may_be_one_of():
    assert uncounted() == NEVER_ONE.keys()
