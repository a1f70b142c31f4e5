"""What README.md shows is run, in a folder with the sample logs, and shows what it says, up to its numbers.

What stands for what: `sample_logs/` is a copy of that folder, with a manifest of its two smallest logs alone.
`intel.log.gz`, a log that is not in the repository, is made of 70 s of the office log after 3000 scans of
standing still, and `intel.relations` of its true poses. `pip install` and `make` are not run: their targets
are looked up, and the lines for shells are tested in tests/cli/test_completion.py.
"""

from __future__ import annotations

import gzip
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from nscan_cli.cli.main import run
from nscan_cli.logs.load import read_log
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.poses import relative
from tests.data import OFFICE_LOG, REPOSITORY, SAMPLE_LOGS
from tests.docs.blocks import blocks

STANDING, MOVING = 3000, 350
MANIFEST_LOGS = ("corridor_and_room.player", "corridor_and_room.mcap")
NOT_EVERYWHERE = re.compile(r"^…|^refused|^ +\d+: |^office: |[Aa]ll \d logs")
"""Lines of what is shown that say for what loops were refused, and what of the smaller manifest."""
NOT_RUN = ("pip ", "make", "eval ", "_NSCAN_CLI_COMPLETE")


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


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the user of the README is."""
    place = tmp_path_factory.mktemp("readme")
    shutil.copytree(SAMPLE_LOGS, place / "sample_logs")
    manifest = place / "sample_logs" / "nightly.toml"
    head, *logs = manifest.read_text().split("[[log]]")
    kept = [log for log in logs if any(f'name = "{name}"' in log for name in MANIFEST_LOGS)]
    manifest.write_text("[[log]]".join([head, *kept]))
    (place / "intel.log.gz").write_bytes(intel_log())
    (place / "intel.relations").write_text(intel_relations(str(place / "intel.log.gz")))
    return place


def calls() -> list[tuple[str, list[str]]]:
    """Each command line of the README and, of those of a console, what it shows below."""
    found: list[tuple[str, list[str]]] = []
    for block in blocks("README.md", "sh"):
        found += [(line.partition("  #")[0].strip(), []) for line in block.splitlines() if line.strip()]
    for block in blocks("README.md", "console"):
        for line in block.splitlines():
            if line.startswith("$ "):
                found.append((line[2:], []))
            else:
                found[-1][1].append(line)
    return found


def shape(line: str) -> str:
    """A line without its numbers, and without what scans there are."""
    return re.sub(r"[-+]?\d[\d.,:e-]*", "#", line).rstrip()


def test_the_readme_has_what_people_come_for():
    lines = [line for line, _shown in calls()]
    for command in ("info", "slam", "calibrate", "render", "match", "nscan", "evaluate", "nightly"):
        assert any(line.startswith(f"nscan-cli {command} ") for line in lines), command
    assert all(line.startswith(("nscan-cli ", *NOT_RUN)) for line in lines)
    assert blocks("README.md", "make")


def test_all_commands_of_the_readme_do_what_it_shows(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", "100")
    for line, shown in calls():
        if line.startswith(NOT_RUN):
            continue
        assert run(shlex.split(line)[1:]) == 0, line
        out, err = capsys.readouterr()
        said = [shape(each) for each in (err + out).splitlines()]
        missing = [each for each in shown if each != "…" and shape(each) not in said]
        # How many loops were refused for what, and how many logs there are, is not the same everywhere.
        missing = [
            each for each in missing if not re.search(r"refused|^ +\d+: |^office: |All \d|all \d", each)
        ]
        assert missing == [], f"{line} said {said}"
    written = {path.name for path in folder.iterdir()}
    assert {"office.json", "office.png", "office.yaml", "office_graph.png", "match.json", "match.png",
            "nscan.json", "nscan.png", "intel.json", "intel.png", "nights"} <= written  # fmt: skip


def test_what_info_shows_is_shown_to_the_letter(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    line, shown = next(call for call in calls() if call[0].startswith("nscan-cli info "))
    assert run(shlex.split(line)[1:]) == 0
    assert capsys.readouterr().out.splitlines() == shown


@pytest.mark.skipif(shutil.which("make") is None, reason="no make")
def test_the_makefile_makes_again_what_has_changed(folder, tmp_path):
    shutil.copytree(folder / "sample_logs", tmp_path / "sample_logs")
    (tmp_path / "settings.toml").write_text("every = 5\n")
    (block,) = blocks("README.md", "make")
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
    for page in ("README.md", "CONTRIBUTING.md"):
        named = set(re.findall(r"(?:`|^)make (?!-)(\w+)", (REPOSITORY / page).read_text(), re.MULTILINE))
        assert named
        assert named <= targets, page


def test_every_file_that_a_page_leads_to_is_there():
    for page in (
        REPOSITORY / "README.md",
        REPOSITORY / "CONTRIBUTING.md",
        *sorted((REPOSITORY / "docs").glob("*.md")),
    ):
        for place in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text()):
            assert (page.parent / place).exists(), f"{page.name}: {place}"
