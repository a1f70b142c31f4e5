"""What README.md and docs/ show is run with the sample logs, and shows what they say but for numbers.

What stands for what: `sample_logs/` is a copy of that folder, with a manifest of its two smallest logs alone.
`intel.log.gz` and `intel.clf`, a log that is not in the repository, are made of 70 s of the office log after
3000 scans of standing still, and `intel.relations` of its true poses. All others are the small log.

What is not of this tool, such as pip and ROS, is not run. Targets of make and modules of tests are looked up,
and the lines for shells are tested in tests/cli/test_completion.py.
"""

from __future__ import annotations

import gzip
import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest

from nscan_cli.cli.main import cli, run
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import relative
from tests.data import CORRIDOR_LOG, OFFICE_LOG, REPOSITORY, SAMPLE_LOGS
from tests.docs.blocks import blocks

PAGES = ["README.md", *(f"docs/{path.name}" for path in sorted((REPOSITORY / "docs").glob("*.md")))]
STANDING, MOVING = 3000, 350
MANIFEST_LOGS = ("corridor_and_room.player", "corridor_and_room.mcap")
NOT_EVERYWHERE = re.compile(r"refused|^ +\d+: |^office: |All \d|all \d")
"""Lines of what is shown that say for what loops were refused, and what of the smaller manifest."""
NOT_OURS = ("pip ", "pipx ", "uv ", "curl ", "ros2 ", "docker ", "make", "eval ", "_NSCAN_CLI_COMPLETE",
            "/tmp/audit/", "python -m venv ", "python3 -m venv ", "python -m pytest ",
            "NSCAN_TEST_KILLS=")  # fmt: skip
OF_TESTS = re.compile(r"^python -m (tests[\w.]*)")
MEASURED_ONCE = ("for i in 1 2 3", "/usr/bin/time ")
"""Lines of docs/soak.md that take minutes; their calls are looked at, and not run."""


def intel_log() -> bytes:
    """The office log from its beginning, after a while of standing still."""
    lines = gzip.decompress(Path(OFFICE_LOG).read_bytes()).decode().splitlines()
    head = [line for line in lines if line.startswith("PARAM")]
    records = [line for line in lines if line.startswith(("FLASER", "TRUEPOS"))][: 2 * MOVING]
    first = next(line for line in records if line.startswith("FLASER")).split()
    still = []
    for k in range(STANDING):
        first[-3] = f"{1e9 - 0.2 * (STANDING - k):.6f}"
        still.append(" ".join(first))
    return gzip.compress("\n".join([*head, *still, *records]).encode() + b"\n", mtime=0)


def intel_relations(log_file: str) -> str:
    """True relative poses half a minute apart."""
    log = read_log(log_file, ReadingOptions())
    assert log.truth is not None
    assert log.truth_times is not None
    rows = []
    for start in range(0, len(log.truth) - 150, 25):
        x, y, angle = relative(log.truth[start + 150], log.truth[start]).tolist()
        stamps = f"{log.truth_times[start]:.6f} {log.truth_times[start + 150]:.6f}"
        rows.append(f"{stamps} {x:.6f} {y:.6f} 0 0 0 {angle:.6f}")
    return "\n".join(rows) + "\n"


def true_trajectory(log_file: str) -> str:
    """The true poses of a log as TUM."""
    log = read_log(log_file, ReadingOptions())
    assert log.truth is not None
    assert log.truth_times is not None
    rows = []
    for time, (x, y, angle) in zip(log.truth_times, log.truth, strict=True):
        rows.append(f"{time:.6f} {x:.6f} {y:.6f} 0 0 0 {np.sin(angle / 2):.9f} {np.cos(angle / 2):.9f}")
    return "\n".join(rows) + "\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the user of the README is."""
    place = tmp_path_factory.mktemp("readme")
    shutil.copytree(SAMPLE_LOGS, place / "sample_logs")
    manifest = place / "sample_logs" / "nightly.toml"
    head, *logs = manifest.read_text().split("[[log]]")
    kept = [log for log in logs if any(f'name = "{name}"' in log for name in MANIFEST_LOGS)]
    manifest.write_text("[[log]]".join([head, *kept]))
    for name in ("intel.log.gz", "intel.clf"):
        packed = intel_log()
        (place / name).write_bytes(packed if name.endswith(".gz") else gzip.decompress(packed))
    (place / "intel.relations").write_text(intel_relations(str(place / "intel.log.gz")))
    assert run(["slam", str(place / "intel.clf"), "-o", str(place / "intel.json"), "-q"]) == 0
    (place / "my_bag").mkdir()
    shutil.copy(SAMPLE_LOGS / "corridor_and_room.mcap", place / "my_bag" / "my_bag_0.mcap")
    for name in ("wide.log", "robot.log.gz"):
        shutil.copy(CORRIDOR_LOG, place / name)
    for name in ("robot.mcap", "drive.mcap"):
        shutil.copy(SAMPLE_LOGS / "corridor_and_room.mcap", place / name)
    for name in ("truth.tum", "other.tum"):
        (place / name).write_text(true_trajectory(CORRIDOR_LOG))
    (place / "logs").mkdir()
    for name in ("intel.log.gz", "intel.relations"):
        shutil.copy(place / name, place / "logs")
    for block in blocks("README.md", "toml"):
        (place / "robots.toml").write_text(block)
    return place


def calls(page: str) -> list[tuple[str, list[str]]]:
    """Each command line of a page and, of those of a console, what it shows below."""
    found: list[tuple[str, list[str]]] = []
    for block in blocks(page, "sh"):
        lines = [re.split(r"(?:^|  )#", line)[0].strip() for line in block.splitlines()]
        found += [(line, []) for line in lines if line]
    for block in blocks(page, "console"):
        for line in block.splitlines():
            if line.startswith("$ "):
                found.append((line[2:], []))
            else:
                found[-1][1].append(line)
    return found


def inline_calls(page: str) -> list[str]:
    """Each whole call of the tool within the text of a page; of a pipe and the like every one."""
    text = re.sub(r"^```.*?^```$", "", (REPOSITORY / page).read_text(), flags=re.MULTILINE | re.DOTALL)
    lines = [" ".join(line.split()) for line in re.findall(r"`(nscan-cli [^`]*)`", text)]
    calls_of_lines = [re.split(r" (?:&&|\|) ", line) for line in lines]
    return [call for several in calls_of_lines for call in several if call.startswith("nscan-cli ")]


def shape(line: str) -> str:
    """A line without its numbers, and without what scans there are."""
    return re.sub(r"[-+]?\d[\d.,:e-]*", "#", line).rstrip()


def test_the_readme_is_short_and_has_what_people_come_for():
    lines = [line for line, _shown in calls("README.md")]
    for begins in ("nscan-cli slam my_bag/", "ros2 run nav2_map_server map_server",
                   "nscan-cli slam intel.clf", "nscan-cli evaluate", "nscan-cli nightly",
                   "uv tool install", "pipx install"):  # fmt: skip
        assert any(line.startswith(begins) for line in lines), begins
    assert len((REPOSITORY / "README.md").read_text().splitlines()) < 200


def test_every_command_is_shown():
    lines = [line for line, _shown in calls("docs/commands.md")]
    for command in ("info", "slam", "calibrate", "render", "match", "nscan", "evaluate", "nightly"):
        assert any(line.startswith(f"nscan-cli {command} ") for line in lines), command


@pytest.mark.parametrize("page", [page for page in PAGES if calls(page)])
def test_all_command_lines_of_a_page_do_what_it_shows(page, folder, tmp_path, monkeypatch, capsys):
    place = tmp_path / "place"
    shutil.copytree(folder, place)
    monkeypatch.chdir(place)
    monkeypatch.setenv("COLUMNS", "100")
    for line, shown in calls(page):
        if line.startswith((*NOT_OURS, *MEASURED_ONCE)):
            continue
        if module := OF_TESTS.match(line):
            assert importlib.util.find_spec(module[1]), line
            continue
        settings, _, call = line.partition(" | ")[0].rpartition("nscan-cli ")
        with monkeypatch.context() as environment:
            for setting in settings.split():
                environment.setenv(*setting.split("=", 1))
            assert run(shlex.split(call)) == 0, line
        out, err = capsys.readouterr()
        said = [shape(each) for each in (err + out).splitlines()]
        missing = [each for each in shown if each != "…" and shape(each) not in said]
        # How many loops were refused for what, and how many logs there are, is not the same everywhere.
        missing = [each for each in missing if not NOT_EVERYWHERE.search(each)]
        assert missing == [], f"{line} said {said}"
    for line, _shown in calls(page):
        for name in re.findall(r" -o ([\w.-]+\w)| --(?:map|plot) ([\w.]+)", line):
            not_run = (*MEASURED_ONCE, *NOT_OURS)
            assert os.path.exists("".join(name)) or line.startswith(not_run), line


@pytest.mark.parametrize("page", PAGES)
def test_calls_within_the_text_are_calls_that_the_command_takes(page):
    parent = click.Context(cli, info_name="nscan-cli")
    for call in inline_calls(page):
        _tool, name, *arguments = shlex.split(call)
        if name != "COMMAND" and "[OPTIONS]" not in arguments and not name.startswith("-"):
            command = cli.get_command(parent, name)
            assert command is not None, call
            command.make_context(name, arguments, parent=parent)


def test_what_info_shows_is_shown_to_the_letter(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    line, shown = next(call for call in calls("docs/commands.md") if call[0].startswith("nscan-cli info "))
    assert run(shlex.split(line)[1:]) == 0
    assert capsys.readouterr().out.splitlines() == shown


@pytest.mark.skipif(shutil.which("make") is None, reason="no make")
def test_the_makefile_makes_again_what_has_changed(folder, tmp_path):
    shutil.copytree(folder / "sample_logs", tmp_path / "sample_logs")
    (tmp_path / "settings.toml").write_text("every = 5\n")
    (block,) = blocks("docs/commands.md", "make")
    tool = f"{shlex.quote(sys.executable)} -m nscan_cli"
    (tmp_path / "Makefile").write_text(block.replace("\tnscan-cli ", f"\t{tool} "))

    def make(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = ["make", "office.errors.json", *arguments]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)

    done = make()
    assert done.returncode == 0, done.stderr
    assert make("-q").returncode == 0
    assert (
        "office.json office.png office.yaml: sample_logs/office.log.gz" in (tmp_path / "office.d").read_text()
    )
    (tmp_path / "settings.toml").write_text("every = 5\nmax-range = 0.3\n")
    assert make("-q").returncode == 1
    (tmp_path / "sample_logs" / "office.log.gz").touch()
    (tmp_path / "settings.toml").write_text("every = 500\n")
    done = make()
    assert done.returncode == 2
    assert "is above 0.05 m" in done.stderr
    assert not (tmp_path / "office.errors.json").exists()


def test_every_target_of_make_that_is_named_is_there():
    targets = set(re.findall(r"^([\w-]+):", (REPOSITORY / "Makefile").read_text(), re.MULTILINE))
    for page in (*PAGES, "CONTRIBUTING.md"):
        named = set(re.findall(r"(?:`|^)make (?!-)(\w+)", (REPOSITORY / page).read_text(), re.MULTILINE))
        assert named <= targets, page


def test_every_file_that_a_page_leads_to_is_there():
    for page in (REPOSITORY / "CONTRIBUTING.md", *(REPOSITORY / page for page in PAGES)):
        for place in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text()):
            assert (page.parent / place).exists(), f"{page.name}: {place}"
