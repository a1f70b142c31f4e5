"""Names of files are bytes, encodings lack characters, and one of a thing is named as one."""

from __future__ import annotations

import ast
import codecs
import itertools
import json
import re

import pytest

from nscan_cli.errors import InputMissingError
from nscan_cli.files.inputs import base_name
from nscan_cli.files.text import counted, encode_fallback, json_bytes, listed, path_of_name, printable
from tests.data import PACKAGE


@pytest.mark.parametrize(
    ("text", "as_shown"),
    [
        ("robot.log", "robot.log"),
        ("Größe θ.log", "Größe θ.log"),
        ("\udcff.log", r"\xff.log"),
        # UTF-8 that Python has read as ASCII; a surrogate from an escape of JSON.
        ("\udcce\udcb8 \udcff ä", r"θ \xff ä"),
        ("\ud800", r"\ud800"),
    ],
)
def test_text_is_shown_as_unicode(text, as_shown):
    assert printable(text) == as_shown
    assert str(InputMissingError(text)) == as_shown


def test_a_name_is_the_same_text_whatever_its_folder():
    assert base_name("f\udcfcr/\udcff.log") == r"\xff.log"
    assert base_name("für/θ.log") == "θ.log"
    assert path_of_name("θ.log") == "θ.log"
    assert path_of_name("\udcff.log") == "\udcff.log"
    assert path_of_name("\ud800") == r"\ud800"


@pytest.mark.parametrize(
    ("encoding", "printed"),
    [("utf-8", "90° ± σ → 日 \\xff"), ("latin-1", "90° ± sigma -> \\u65e5 \\xff"),
     ("ascii", "90 deg +- sigma -> \\u65e5 \\xff")],
)  # fmt: skip
def test_what_an_encoding_lacks_is_printed_in_other_characters(encoding, printed):
    codecs.register_error("plain", encode_fallback)
    assert "90° ± σ → 日 \udcff".encode(encoding, "plain").decode(encoding) == printed


def test_json_escapes_what_is_no_unicode():
    text = json.dumps("°\udcff\ud800", ensure_ascii=False)
    assert json_bytes(text) == b'"\xc2\xb0\\udcff\\ud800"'


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


@pytest.mark.parametrize(
    ("names", "said"), [([], ""), (["a"], "a"), (["a", "b"], "a or b"), (["a", "b", "c"], "a, b or c")]
)
def test_listed(names, said):
    assert listed(names, "or") == said


THINGS = re.compile(
    r" (scans|records|messages|iterations|evaluations|keyframes|poses|loops|pairs|steps|stamps)\b"
)

ALTERNATING = (
    " scans of the laser that comes first are read, which may need --mount; give each laser its own topic "
    "and frame; --as-recorded reads all as those of one laser"
)
NEVER_ONE = {
    ("cli/nightly_progress.py", " scans, "): "so many of so many",
    ("cli/nscan.py", " scans"): "a limit",
    ("cli/slam_summary.py", " scans a second, "): "a rate",
    ("evaluation/evaluation_report.py", " poses match within "): "a trajectory is aligned by several",
    ("graph/io/json_fields.py", " poses of three "): "of a joint relation",
    ("logs/raw_scans.py", " scans of up to "): "beyond a limit",
    ("logs/text/carmen.py", " records"): "a tag",
    ("logs/text/carmen.py", " scans; --laser can be "): "a tag",
    ("logs/text/corrected_poses.py", " records"): "a tag",
    ("logs/recordings/alternating_lasers.py", ALTERNATING): "two lasers alternate many times",
    ("logs/recordings/mcap.py", " messages on "): "so many of so many",
    ("logs/recordings/sweep_segments.py", " messages of "): "a turn in one message is whole",
    ("mapping/figures/match_plots.py", " scans, least overlap "): "of a joint match",
    ("slam/local_matching/joint_relations.py", " scans match each other"): "so many of so many",
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
