"""Names of files are bytes, and encodings lack characters."""

from __future__ import annotations

import codecs
import json

import pytest

from nscan_cli.errors import InputMissingError
from nscan_cli.files.inputs import base_name
from nscan_cli.files.text import encode_fallback, json_bytes, path_of_name, printable


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
