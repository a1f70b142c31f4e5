"""SPEC, the scans of `nscan`."""

from __future__ import annotations

import pytest

from nscan_cli.cli.nscan import scans_from


@pytest.mark.parametrize(
    ("spec", "scans"),
    [
        ("10,12,14-20", [10, 12, *range(14, 21)]),
        ("100-190:10", list(range(100, 200, 10))),
        ("7, 3", [7, 3]),
        ("0-5:2,9", [0, 2, 4, 9]),
    ],
)
def test_spec(spec, scans):
    assert scans_from(spec) == tuple(scans)


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("", "not of the form"), ("a", "not of the form"), ("1,,2", "not of the form"),
        ("1-", "not of the form"), ("1:2", "not of the form"), ("-3", "not of the form"),
        ("1.5,2", "not of the form"), ("9-3", "backwards"), ("1-9:0", "step of 0"), ("5", "only one scan"),
        ("5-9:10", "only one scan"), ("1,2,1", "scan 1 twice"), ("1-5,3-7", "scan 3 twice"),
        ("0-99999999999", "more than 500"),
    ],
)  # fmt: skip
def test_spec_that_is_none(spec, said):
    with pytest.raises(ValueError, match=said):
        scans_from(spec)
