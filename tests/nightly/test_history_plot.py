from __future__ import annotations

import re
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, fromstring

from nscan_cli.nightly.history_plot import MAX_RUNS, history_svg
from nscan_cli.nightly.manifest import ManifestEntry
from nscan_cli.nightly.regression_check import check_log
from nscan_cli.nightly.run_history import RunRecord
from tests.nightly.test_regression_check import FAILED, done

ENTRY = ManifestEntry("a", {"log": Path("a.log"), "relations": Path("r")}, 0.05)


def plot(*nights: RunRecord) -> Element:
    svg = history_svg(check_log(ENTRY, list(nights), [], False))
    return fromstring(svg)


def classes(svg: Element, name: str) -> list[Any]:
    return [part for part in svg if part.get("class") == name]


def test_a_dot_for_each_night_and_a_cross_for_a_failure():
    svg = plot(done(0.02), FAILED, done(0.04))
    first, last = classes(svg, "dot")
    assert float(first.get("cx")) < float(last.get("cx"))
    base = float(classes(svg, "axis")[0].get("y1"))
    # The heights are as the errors, and the bound's as the bound.
    height = base - float(first.get("cy"))
    assert abs((base - float(last.get("cy"))) - 2 * height) < 0.2
    assert abs((base - float(classes(svg, "bound")[0].get("y1"))) - 2.5 * height) < 0.3
    (cross,) = classes(svg, "fail")
    assert cross[0].text == "failed: it died; "


def test_all_lies_inside():
    svg = plot(*(done(0.01 * k) for k in range(1, 60)))
    dots = classes(svg, "dot")
    assert len(dots) == MAX_RUNS
    assert all(0 <= float(dot.get("cx")) <= 340 and 0 <= float(dot.get("cy")) <= 96 for dot in dots)
    assert svg[-1].text == "59 runs"


def test_without_any_errors_there_is_still_a_plot():
    assert not classes(plot(FAILED), "bound")
    assert not re.search("nan", history_svg(check_log(ENTRY, [done(0.0)], [], False)))
