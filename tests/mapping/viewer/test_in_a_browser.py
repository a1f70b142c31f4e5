"""The page of a map in Chromium, at the width of a phone and of a desk, in light and dark, and in print."""

from __future__ import annotations

import base64
import dataclasses
import io
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from nscan_cli.graph.model import Graph, Loop
from nscan_cli.logs.beam_times import BeamTimes
from nscan_cli.mapping.occupancy import occupancy_grid
from nscan_cli.mapping.viewer.viewer_page import viewer_page
from tests.browser import CHROMIUM, Page, browser_page
from tests.mapping.handmade_logs import half_circle
from tests.mapping.viewer.unpack import block_of

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
WIDTHS = (390, 1280)
EVIL = "</script><script>wrong()</script>"
COUNT = 21
RADIUS = 3.0
LAYERS = ["path", "loops", "refused", "keyframes", "uncertainty", "scan", "notices"]


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot that drives 2 m straight ahead; every scan is a half circle of 3 m."""
    log = half_circle(np.full((COUNT, 181), RADIUS))
    poses = np.column_stack([0.1 * np.arange(COUNT), np.zeros((COUNT, 2))])
    anchors = np.arange(COUNT) // 10 * 10
    graph = Graph(
        scans=np.arange(COUNT),
        stamps=[f"{0.2 * k:.1f}" for k in range(COUNT)],
        poses=poses,
        odometry=None,
        anchors=anchors,
        loops=[Loop((0, 20), True, "", 1.0), Loop((0, 10), False, EVIL, 0.1)],
        marginals={10: np.eye(3) * 1e-4, 20: np.eye(3) * 4e-4},
        provenance={"inputs": [], "notices": [f"tracking broke at scan 5; {EVIL}"]},
    )
    rows = np.arange(COUNT)
    page = viewer_page(EVIL, occupancy_grid(log, rows, poses), graph, log, rows, rows)
    path = tmp_path_factory.mktemp("page") / "map.html"
    path.write_bytes(page)
    return path


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with browser_page(tmp_path_factory.mktemp("profile")) as page:
        yield page


def colours(page: Page) -> np.ndarray:
    """(H, W, 3) the window."""
    picture: np.ndarray = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB")).astype(int)
    return picture


def stage(page: Page) -> dict[str, float]:
    box: dict[str, float] = page.run("document.querySelector('.stage').getBoundingClientRect().toJSON()")
    return box


def says(page: Page) -> str:
    page.settle()
    text: str = page.run("document.querySelector('.says').textContent")
    return text


def place(page: Page, x: float, y: float) -> tuple[float, float]:
    """The pixel of a place (m) in a map that is shown as a whole."""
    box, bounds = stage(page), (-0.05, -3.05, 5.1, 3.1)
    scale = min(box["width"] / (bounds[2] - bounds[0]), box["height"] / (bounds[3] - bounds[1]))
    centre = (bounds[0] + bounds[2]) / 2, (bounds[1] + bounds[3]) / 2
    return (
        box["x"] + box["width"] / 2 + (x - centre[0]) * scale,
        box["y"] + box["height"] / 2 - (y - centre[1]) * scale,
    )


def place_told(page: Page) -> tuple[float, float]:
    match = re.match(r"x (-?[\d.]+) m, y (-?[\d.]+) m", says(page))
    assert match
    return float(match[1]), float(match[2])


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("dark", [False, True])
def test_the_map_is_seen_and_nothing_is_wider_than_the_window(browser, file, width, dark):
    browser.open(file, width, 800, dark)
    assert browser.wrong == []
    assert browser.run("document.documentElement.scrollWidth") <= width
    box = stage(browser)
    assert box["width"] > 0.7 * width
    assert box["height"] > 300
    assert (
        browser.run("[...document.querySelectorAll('[data-layer]')].map((box) => box.dataset.layer)")
        == LAYERS
    )
    # Free space around the robot is light or dark, the half circle of walls the other.
    pixels = colours(browser)
    x, y = place(browser, 1.5, 1.0)
    inside = pixels[round(y), round(x)]
    assert (inside.max() < 40) if dark else (inside.min() > 240)
    whole = pixels[:, : int(box["width"])].reshape(-1, 3)
    walls = (whole.min(axis=1) > 150) if dark else (whole.max(axis=1) < 110)
    assert walls.sum() > 200


@pytest.mark.parametrize("width", WIDTHS)
def test_the_scan_under_the_pointer(browser, file, width):
    browser.open(file, width, 800)
    browser.run("for (const box of document.querySelectorAll('[data-layer]')) if (box.checked) box.click()")
    browser.run("document.querySelector('[data-layer=scan]').click()")
    browser.settle()

    def red() -> int:
        pixels = colours(browser)
        return int(((pixels[..., 0] > 180) & (pixels[..., 1:].max(axis=-1) < 110)).sum())

    before = red()
    browser.mouse("mouseMoved", *place(browser, 1.0, 0.0))
    assert "scan 10, 0:02.0 min, sigma 0.010 m" in says(browser)
    assert red() > before + 150
    browser.mouse("mouseMoved", *place(browser, 3.0, 2.0))
    assert "scan" not in says(browser)
    # Only the knob of the slider is left.
    assert red() < before + 150


def test_a_refused_loop_says_why_and_where(browser, file):
    browser.open(file, 1280, 800)
    browser.run("document.querySelector('[data-layer=loops]').click()")
    browser.mouse("mouseMoved", *place(browser, 0.5, 0.02))
    assert "refused" not in says(browser)
    browser.run("document.querySelector('[data-layer=refused]').click()")
    browser.mouse("mouseMoved", *place(browser, 0.5, 0.0))
    assert f"loop between scans 0 and 10: refused: {EVIL}, score 0.10" in says(browser)
    listed = browser.run("document.querySelector('details').textContent")
    assert listed == f"1 refused loopscans 0 and 10: refused: {EVIL}, score 0.10"


def test_a_click_on_a_notice_goes_there(browser, file):
    browser.open(file, 1280, 800)
    assert browser.run("document.querySelector('ol').textContent") == f"tracking broke at scan 5; {EVIL}"
    browser.run("document.querySelector('ol button').click()")
    box = stage(browser)
    browser.mouse("mouseMoved", box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert place_told(browser) == pytest.approx((0.5, 0.0), abs=0.02)


@pytest.mark.parametrize("width", WIDTHS)
def test_two_clicks_measure(browser, file, width):
    browser.open(file, width, 800)
    browser.run("document.querySelector('.tools button:last-child').click()")
    browser.click(*place(browser, 1.0, 1.0))
    browser.mouse("mouseMoved", *place(browser, 4.0, 1.0))
    told = re.search(r"; ([\d.]+) m$", says(browser))
    assert told
    assert float(told[1]) == pytest.approx(3.0, abs=0.05)


def test_the_wheel_zooms_to_the_pointer_and_the_mouse_drags(browser, file):
    browser.open(file, 1280, 800)
    x, y = place(browser, 2.0, 1.0)
    browser.mouse("mouseMoved", x, y)
    assert place_told(browser) == pytest.approx((2.0, 1.0), abs=0.02)
    browser.mouse("mouseWheel", x, y, deltaX=0, deltaY=-500)
    browser.mouse("mouseMoved", x, y)
    assert place_told(browser) == pytest.approx((2.0, 1.0), abs=0.02)
    browser.mouse("mousePressed", x, y, button="left", clickCount=1)
    for step in (40, 80):
        browser.mouse("mouseMoved", x + step, y, button="left", buttons=1)
    browser.mouse("mouseReleased", x + 80, y, button="left", clickCount=1)
    browser.mouse("mouseMoved", x + 80, y)
    assert place_told(browser) == pytest.approx((2.0, 1.0), abs=0.02)
    # A drag is no click: time has stayed.
    assert browser.run("document.querySelector('.time output').textContent") == "21 scans, 0:04.0 min"


@pytest.mark.parametrize("width", WIDTHS)
def test_the_slider_of_time(browser, file, width):
    browser.open(file, width, 800)
    browser.run("(() => { const slider = document.querySelector('[type=range]'); slider.value = 7; "
                "slider.dispatchEvent(new Event('input', { bubbles: true })); })()")  # fmt: skip
    assert browser.run("document.querySelector('.time output').textContent") == "scan 7, 0:01.4 min"
    browser.click(*place(browser, 1.5, 0.0))
    assert browser.run("document.querySelector('.time output').textContent") == "scan 15, 0:03.0 min"


def test_print_is_one_light_page_without_controls(browser, file):
    browser.open(file, 1280, 800, dark=True)
    browser.run("new Promise((done) => setTimeout(done, 400))")
    assert browser.pdf().count(b"/Type /Page\n") == 1
    browser.call("Emulation.setEmulatedMedia", media="print")
    browser.settle()
    pixels = colours(browser)
    browser.call("Emulation.setEmulatedMedia", media="")
    assert pixels.mean() > 200
    assert browser.run("document.querySelector('.tools').offsetHeight") > 0


def test_beams_of_a_turning_laser_begin_where_it_was(browser, tmp_path):
    """The robot turns by 90° in a second and drives 1 m; the last of 181 beams is half a second late."""
    log = half_circle(np.full((2, 181), RADIUS))
    log = dataclasses.replace(log, beam_times=BeamTimes(np.zeros(2), np.full(2, 0.5 / 180)))
    poses = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, np.pi / 2]])
    rows = np.arange(2)
    graph = Graph(rows, ["0.0", "1.0"], poses, None, np.zeros(2, dtype=np.int64))
    page = viewer_page("turning", occupancy_grid(log, rows, poses), graph, log, rows, rows)
    shared = "(window.points = scanPoints, window.read = unpack, show(element))"
    (tmp_path / "map.html").write_text(page.decode().replace("  show(element).catch", f"  {shared}.catch"))
    browser.open(tmp_path / "map.html", 1280, 800)
    text = base64.b64encode(block_of(page.decode())).decode()
    points = browser.run(
        f"(async () => {{ const element = document.createElement('div'); "
        f"element.innerHTML = '<script>{text}</script>'; return points(await read(element), 0); }})()"
    )
    ends = np.array(points).reshape(-1, 2)
    share = 0.5 * np.arange(181) / 180
    angles = share * np.pi / 2 + np.radians(np.arange(-90, 91))
    assert ends == pytest.approx(
        np.column_stack([share + RADIUS * np.cos(angles), RADIUS * np.sin(angles)]), abs=1e-3
    )
