"""The report in a browser: no other resource is needed, nothing is wider than the window, maps are seen."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from nscan_cli.nightly.html_report import html_report
from nscan_cli.nightly.manifest import ManifestEntry, read_manifest
from nscan_cli.nightly.regression_check import check_log
from nscan_cli.nightly.run_history import read_runs
from tests.browser import CHROMIUM, browser_page
from tests.nightly.test_regression_check import FAILED

EVIL = '<script>alert(1)</script>&"'
MEASURE = """(() => {
  const root = document.documentElement;
  return {
    wide: Math.max(root.scrollWidth, document.body.scrollWidth), window: root.clientWidth,
    maps: [...document.querySelectorAll(".viewer.live .stage")].map((stage) =>
      [stage.querySelector("img").naturalWidth, stage.clientWidth, stage.clientHeight]),
    ground: getComputedStyle(document.body).backgroundColor,
    first: document.querySelector("h1").getBoundingClientRect().bottom,
  };
})()"""


@pytest.fixture(scope="module")
def pages(small, undisturbed):
    """A good night, and one with everything in it that can go wrong."""
    entries = read_manifest(str(small), None)
    nights = {entry.name: read_runs(undisturbed / entry.name) for entry in entries}
    good = [check_log(entry, nights[entry.name], [], False) for entry in entries]
    name = "a_name_that_is_as_long_as_names_of_logs_can_be_on_some_days.2026-11-21"
    bad = [
        *good,
        check_log(entries[0], [*nights["one"], {**FAILED, "reason": EVIL}], [EVIL], False),
        check_log(
            ManifestEntry(name, {"log": Path("x" * 200)}, sources={"log": f"javascript:{EVIL}"}), [], [], True
        ),
        check_log(
            ManifestEntry(name + "2", {"log": Path("x")}), [{**FAILED, "reason": "word " * 80}], [], False
        ),
    ]
    return {
        "good": html_report("small", good, undisturbed).decode(),
        "bad": html_report(EVIL, bad, undisturbed).decode(),
    }


class Tags(HTMLParser):
    """The tags that are open, and all references."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.references: list[str] = []

    def handle_starttag(self, tag, attrs):
        if tag not in ("meta", "link", "img", "input", "br"):
            self.open.append(tag)
        self.references += [value for key, value in attrs if key in ("src", "href", "data", "srcset")]

    def handle_startendtag(self, tag, attrs):
        pass

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.mark.parametrize("kind", ["good", "bad"])
def test_the_page_is_whole_and_needs_nothing_else(pages, kind):
    text = pages[kind]
    tags = Tags()
    tags.feed(text)
    assert tags.open == []
    loaded = [where for where in tags.references if not where.startswith(("#", "data:"))]
    assert set(loaded) <= {
        f"{name}/map.{kind}" for name in ("one", "two", "three") for kind in ("png", "html")
    }
    assert not re.search(r"@import|url\(", text)
    assert EVIL not in text
    assert "javascript:" not in re.findall(r'href="([^"]*)"', text)


def test_the_top_says_whether_the_night_was_good(pages):
    assert '<section class="banner good">' in pages["good"]
    assert "<h1>All 3 logs are good</h1>" in pages["good"]
    assert 'class="look"' not in pages["good"]
    assert '<section class="banner failed">' in pages["bad"]
    assert "<h1>2 of 5 logs failed</h1>" in pages["bad"]
    assert pages["bad"].index('class="look"') < pages["bad"].index("<table>")


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with browser_page(tmp_path_factory.mktemp("profile")) as page:
        yield page


@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
@pytest.mark.parametrize(
    ("kind", "width", "dark"),
    [("good", 390, False), ("good", 1280, True), ("bad", 390, True), ("bad", 1280, False)],
)
def test_in_a_browser(pages, browser, tmp_path, kind, width, dark):
    (tmp_path / "report.html").write_text(pages[kind])
    browser.open(tmp_path / "report.html", width, 900, dark)
    found = browser.run(MEASURE)
    assert browser.wrong == []
    assert found["window"] <= width
    assert found["wide"] <= found["window"]
    assert len(found["maps"]) == (3 if kind == "good" else 4)
    for natural, shown, height in found["maps"]:
        assert natural > 50
        assert shown > 0.3 * width
        assert height > 50
    assert found["first"] < 300
    # Of the ground: #f4f4f1, or #14171a.
    assert found["ground"] == ("rgb(20, 23, 26)" if dark else "rgb(244, 244, 241)")
    # The wheel scrolls the page past a map; zoom is by its buttons.
    browser.run("document.querySelector('.viewer .tools button').click()")
    browser.settle()
    assert browser.run(MEASURE)["wide"] <= found["window"]


def test_a_failed_log_has_no_figures_in_the_overview_and_its_last_good_map_below(pages):
    rows = re.findall(r"<tr><th>.*?</tr>", pages["bad"].partition("<tbody>")[2])
    errors = [re.findall(r'<td class="number">(0\.\d{4})</td>', row) for row in rows]
    assert [len(error) for error in errors] == [1, 1, 1, 0, 0]
    # What never was there has its few words at the end alone.
    assert "One more log is missing" in pages["bad"]
    assert pages["bad"].count("Below: the last run that did not fail.") == 1
    assert pages["bad"].count("data:image/png") == 4
