"""The report in a browser: no other resource is needed, nothing is wider than the window, maps are seen."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest

from nscan_cli.nightly.html_report import html_report
from nscan_cli.nightly.manifest import ManifestEntry, read_manifest
from nscan_cli.nightly.regression_check import check_log
from nscan_cli.nightly.run_history import read_runs
from tests.nightly.test_regression_check import FAILED

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
         "--disable-background-networking", "--disable-component-update", "--disable-sync",
         "--virtual-time-budget=4000", "--dump-dom"]  # fmt: skip
DARK, LIGHT = 0, 1
EVIL = '<script>alert(1)</script>&"'
LISTEN = "<script>window.wrong = []; onerror = (what) => { wrong.push(String(what)); };</script>"
MEASURE = """<script>
addEventListener("load", () => setTimeout(() => {
  const root = document.documentElement, map = document.querySelector(".map");
  const wide = () => Math.max(root.scrollWidth, document.body.scrollWidth);
  const before = wide(), sheet = map.querySelector(".sheet").clientWidth;
  map.querySelector("button").click();
  parent.postMessage(JSON.stringify({
    wrong, before, after: wide(), window: root.clientWidth,
    maps: [...document.querySelectorAll(".map img")].map((image) =>
      [image.naturalWidth, image.clientWidth, image.clientHeight]),
    grown: map.querySelector(".sheet").clientWidth / sheet,
    dark: getComputedStyle(document.body).backgroundColor,
    first: document.querySelector("h1").getBoundingClientRect().bottom,
  }), "*");
}, 200));
</script>"""


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
    assert set(loaded) <= {"one/map.png", "two/map.png", "three/map.png"}
    assert not re.search(r"@import|url\(", text)
    assert EVIL not in text
    assert "javascript:" not in re.findall(r'href="([^"]*)"', text)


def test_the_top_says_whether_the_night_was_good(pages):
    assert '<section class="banner good">' in pages["good"]
    assert "<h1>All 3 logs are good</h1>" in pages["good"]
    assert 'class="look"' not in pages["good"]
    assert '<section class="banner failed">' in pages["bad"]
    assert "<h1>Not good: of 5 logs, 2 failed</h1>" in pages["bad"]
    assert pages["bad"].index('class="look"') < pages["bad"].index("<table>")


@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
@pytest.mark.parametrize(
    ("kind", "width", "scheme"),
    [("good", 390, LIGHT), ("good", 1280, DARK), ("bad", 390, DARK), ("bad", 1280, LIGHT)],
)
def test_in_a_browser(pages, tmp_path, kind, width, scheme):
    content = pages[kind].replace("<head>", f"<head>{LISTEN}", 1).replace("</body>", f"{MEASURE}</body>")
    # A frame may be as narrow as a phone; a window of this browser may not.
    (tmp_path / "frame.html").write_text(
        "<script>onmessage = (said) => { document.title = said.data; };</script>"
        f'<iframe style="width: {width}px; height: 900px; border: 0" '
        f'srcdoc="{html.escape(content)}"></iframe>'
    )
    window = [f"--user-data-dir={tmp_path / 'profile'}", f"--blink-settings=preferredColorScheme={scheme}",
              f"--window-size={width + 100},1000"]  # fmt: skip
    call = [str(CHROMIUM), *FLAGS, *window, (tmp_path / "frame.html").as_uri()]
    dom = subprocess.run(call, capture_output=True, text=True, timeout=60, check=True).stdout
    title = re.search(r"<title>(.*?)</title>", dom)
    assert title, "the page has said nothing"
    found = json.loads(html.unescape(title[1]))
    assert found["wrong"] == []
    assert found["window"] <= width
    assert found["before"] <= found["window"]
    assert found["after"] <= found["window"]
    assert found["maps"]
    for natural, shown, height in found["maps"]:
        assert natural > 50
        assert shown > 0.3 * width
        assert height > 50
    assert found["grown"] == pytest.approx(2, rel=0.1)
    assert found["first"] < 300
    # Of the ground: #f4f4f1, or #14171a.
    assert found["dark"] == ("rgb(20, 23, 26)" if scheme == DARK else "rgb(244, 244, 241)")


def test_a_failed_log_has_no_figures_in_the_overview_and_its_last_good_map_below(pages):
    rows = re.findall(r"<tr><th>.*?</tr>", pages["bad"].partition("<tbody>")[2])
    errors = [re.findall(r'<td class="number">(0\.\d{4})</td>', row) for row in rows]
    assert [len(error) for error in errors] == [1, 1, 1, 0, 0]
    # What never was there has its few words at the end alone.
    assert "One more log is not there" in pages["bad"]
    assert pages["bad"].count("Below: the last run that did not fail.") == 1
    assert pages["bad"].count("data:image/png") == 4
