"""A few damaged inputs in the ordinary suite; `make soak` has the many."""

from __future__ import annotations

import warnings

import pytest

from nscan_cli.errors import InputDataError
from tests.soak import readers
from tests.soak.corpus import samples
from tests.soak.read_all import mutant
from tests.soak.readers import UnsoundError, outcome

COUNT = 800


def test_damaged_inputs_are_read_or_refused(tmp_path, capsys):
    every, path = samples(), tmp_path / "input"
    seen = set()
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        for number in range(COUNT):
            form, data, chance = mutant(0, number, every)
            path.write_bytes(data)
            seen.add((form, outcome(form, str(path), chance)))
    assert {form for form, _ in seen} == set(every)
    assert {(form, "read") for form in every} <= seen
    assert {(form, "InputDataError (65)") for form in every} <= seen


def test_the_same_number_gives_the_same_input():
    every = samples()
    assert [mutant(3, k, every)[:2] for k in range(40)] == [mutant(3, k, every)[:2] for k in range(40)]


@pytest.mark.parametrize("error", [ValueError("a bug"), InputDataError("file", "x" * 10, "mend it")])
def test_a_fault_is_told_from_a_refusal(tmp_path, monkeypatch, error):
    def broken(path: str, chance: object) -> None:
        raise error

    monkeypatch.setattr(readers, "READERS", {"tum": [broken]})
    _, _, chance = mutant(0, 0, {"tum": [b"x"]})
    if isinstance(error, InputDataError):
        assert outcome("tum", str(tmp_path / "x"), chance) == "InputDataError (65)"
        monkeypatch.setattr(readers, "LONGEST", 5)
        with pytest.raises(UnsoundError):
            outcome("tum", str(tmp_path / "x"), chance)
    else:
        with pytest.raises(ValueError, match="a bug"):
            outcome("tum", str(tmp_path / "x"), chance)
