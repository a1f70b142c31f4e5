"""Small logs with their truth, a manifest over them, and reports without what differs from call to call."""

from __future__ import annotations

import json
import re
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

from nscan_cli.nightly.manifest import ManifestEntry
from tests.cli.room_logs import room_drive, room_log
from tests.logs.recordings.ros import split_bag2

SCANS = {"one": 12, "two": 16, "three": 20}
BOUND = 0.5
"""m; far above the error of any of them."""


def write_logs(folder: Path) -> Path:
    """The logs, their true poses as TUM files, and the manifest, whose path is returned."""
    tables = []
    for name, scans in SCANS.items():
        (folder / f"{name}.log").write_text(room_log(scans))
        poses = [f"{100 + 0.2 * k:.6f} {0.1 * k:.9f} 0 0 0 0 0 1\n" for k in range(scans)]
        (folder / f"{name}.tum").write_text("".join(poses))
        tables.append(
            f'[[log]]\nname = "{name}"\npath = "{name}.log"\nreference = "{name}.tum"\n'
            f"max_translation = {BOUND}\n"
            'published = { "A" = 0.03, "B" = 0.01 }\n'
        )
    manifest = folder / "small.toml"
    manifest.write_text("\n".join(tables))
    return manifest


def recordings(folder: Path) -> list[ManifestEntry]:
    """A folder with a split recording, and a database with a write-ahead log beside it."""
    split_bag2(room_drive(), folder / "my_bag", "MCAP")
    made = split_bag2(room_drive(), folder / "made", "SQLITE3", 1) / "made_0.db3"
    with closing(sqlite3.connect(made)) as database:
        database.execute("PRAGMA journal_mode=WAL")
        database.execute("CREATE TABLE copy AS SELECT * FROM messages WHERE id > 20")
        database.execute("DELETE FROM messages WHERE id > 20")
        database.commit()
        database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        database.execute("INSERT INTO messages SELECT * FROM copy")
        database.commit()
        shutil.copy(made, folder / "lab.db3")
        shutil.copy(f"{made}-wal", folder / "lab.db3-wal")
    shutil.rmtree(folder / "made")
    return [
        ManifestEntry("split", {"log": folder / "my_bag"}),
        ManifestEntry("lab", {"log": folder / "lab.db3"}),
    ]


def copy_of(folder: Path, place: Path) -> Path:
    """A folder of nights to change."""
    shutil.copytree(folder, place)
    return place


def results(folder: Path) -> dict[str, bytes]:
    """Every file of a folder of nights, without what may differ from call to call."""
    files = {str(path.relative_to(folder)): path for path in sorted(folder.rglob("*")) if path.is_file()}
    return {name: _without_times(path) for name, path in files.items()}


def _without_times(path: Path) -> bytes:
    text = path.read_bytes()
    if path.name == "report.json":
        return json.dumps(_stripped(json.loads(text))).encode()
    if path.name == "nights.jsonl":
        return "\n".join(json.dumps(_stripped(json.loads(line))) for line in text.splitlines()).encode()
    if path.name == "report.html":
        return re.sub(rb'<(span|time) class="time".*?</\1>', b"", text)
    return text


def _stripped(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _stripped(entry) for key, entry in value.items() if key != "times"}
    return [_stripped(entry) for entry in value] if isinstance(value, list) else value
