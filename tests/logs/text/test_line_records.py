"""Numbers in text: the same, whether a kernel reads them or NumPy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nscan_cli.kernels.decorators import load_runtime
from nscan_cli.logs.text import line_records
from nscan_cli.logs.text.line_records import KERNEL_MIN_BYTES, floats

plain = st.from_regex(r"[+-]?([0-9]{1,15}(\.[0-9]{0,6})?|\.[0-9]{1,22})", fullmatch=True)
other = st.sampled_from(
    [
        "1e5",
        "-2.5E-07",
        "0.10000000000000000555",
        "9007199254740993",
        "123456789012345678901",
        "0." + "0" * 25,
    ]
)
no_number = st.sampled_from(["x", "-", ".", "1.2.3", "--1", "+-1", "1-2", "1,2", "1e", "0x10", "\xa0"])
blanks = st.text(" \t\n\v\f\r", min_size=1, max_size=3)


@pytest.fixture(scope="module", autouse=True)
def kernels_are_up() -> None:
    load_runtime()


def long_text(tokens: list[str], blank: str) -> bytes:
    """A text that is long enough for the kernel, and begins with these tokens."""
    return blank.join([*tokens, *["0.25"] * (KERNEL_MIN_BYTES // 4), "-7"]).encode("latin-1")


@settings(max_examples=60, deadline=None)
@given(st.lists(plain | other, max_size=6), blanks)
def test_numbers_of_a_long_text_are_the_nearest_there_are(tokens, blank):
    values = floats(long_text(tokens, blank))
    # Python's own are correctly rounded. Bytes, for −0 is 0.
    assert values is not None
    assert values[: len(tokens)].tobytes() == np.array([float(token) for token in tokens]).tobytes()
    assert values.size == len(tokens) + KERNEL_MIN_BYTES // 4 + 1
    assert values[-1] == -7


@settings(max_examples=60, deadline=None)
@given(st.lists(plain, max_size=3), no_number, blanks)
def test_what_is_no_number_spoils_a_long_text_as_a_short_one(tokens, strange, blank):
    assert floats(long_text([*tokens, strange], blank)) is None
    assert floats(blank.join([*tokens, strange, "1"]).encode("latin-1")) is None


def test_numpy_is_asked_only_where_numbers_are_not_plain_or_no_kernels_are_up(
    monkeypatch: pytest.MonkeyPatch,
):
    def refuse(*_arguments: object, **_options: object) -> None:
        raise AssertionError("the kernel should have read it")

    monkeypatch.setattr(np, "fromstring", refuse)
    assert floats(long_text(["1076354563.123456", "-0.000", "81.83"], " ")) is not None
    with pytest.raises(AssertionError):
        floats(long_text(["1e5"], " "))
    monkeypatch.setattr(line_records, "runtime_is_loaded", lambda: False)
    with pytest.raises(AssertionError):
        floats(long_text(["1.5"], " "))
