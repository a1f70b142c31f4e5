from __future__ import annotations

import errno
import os
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from nscan_cli.errors import OutputError
from nscan_cli.files.outputs import (
    TEMPORARY_PREFIX,
    atomic_file,
    check_writable,
    write_atomically,
    write_once,
)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def write_and_fail(path: Path, error: BaseException) -> None:
    with atomic_file(str(path)) as file:
        file.write(b"new")
        raise error


def test_the_file_appears_whole_at_the_end(tmp_path):
    target = tmp_path / "out.json"
    with atomic_file(str(target)) as file:
        file.write(b"half")
        file.flush()
        assert not target.exists()
        file.write(b" and half")
    assert target.read_bytes() == b"half and half"
    assert names(tmp_path) == ["out.json"]


@pytest.mark.parametrize("error", [ValueError(), KeyboardInterrupt(), SystemExit()])
def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path, error):
    target = tmp_path / "out.json"
    target.write_bytes(b"old")
    with pytest.raises(type(error)):
        write_and_fail(target, error)
    assert target.read_bytes() == b"old"
    assert names(tmp_path) == ["out.json"]


def test_a_failure_leaves_no_file_where_there_was_none(tmp_path):
    with pytest.raises(ZeroDivisionError):
        write_and_fail(tmp_path / "out.json", ZeroDivisionError())
    assert names(tmp_path) == []


def test_a_full_disk_is_an_output_error_and_leaves_nothing(tmp_path):
    with pytest.raises(OutputError, match=r"out\.json: cannot be written: No space left"):
        write_and_fail(tmp_path / "out.json", OSError(28, "No space left on device"))
    assert names(tmp_path) == []


def test_the_file_has_the_rights_that_the_umask_gives(tmp_path):
    before = os.umask(0o027)
    try:
        write_atomically(str(tmp_path / "out.json"), b"x")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "out.json").stat().st_mode) == 0o640


def test_what_a_killed_process_has_left_is_cleared_away(tmp_path):
    """But not what another one is writing at the moment."""
    for name in ("dead", "dead2"):
        (tmp_path / f"{TEMPORARY_PREFIX}{name}").write_bytes(b"half")
    other = (
        "import sys; from nscan_cli.files.outputs import atomic_file\n"
        "with atomic_file('other.json') as f: f.write(b'x'); print(1, flush=True); sys.stdin.read()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", other], cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert process.stdout is not None
    process.stdout.readline()
    left = set(names(tmp_path))
    assert len(left) == 1
    write_atomically(str(tmp_path / "out.json"), b"new")
    assert set(names(tmp_path)) == {"out.json", *left}
    process.communicate(b"")
    assert names(tmp_path) == ["other.json", "out.json"]
    process = subprocess.Popen(
        [sys.executable, "-c", other], cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert process.stdout is not None
    process.stdout.readline()
    process.kill()
    process.communicate()
    assert len(names(tmp_path)) == 3
    write_atomically(str(tmp_path / "out.json"), b"newer")
    assert names(tmp_path) == ["other.json", "out.json"]


def test_a_link_stays_a_link_and_its_file_is_replaced(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / "out.json").write_bytes(b"old")
    link = tmp_path / "link.json"
    link.symlink_to("real/out.json")
    write_atomically(str(link), b"new")
    assert link.is_symlink()
    assert (tmp_path / "real" / "out.json").read_bytes() == b"new"


def test_devices_and_pipes_are_written_to_and_not_replaced(tmp_path):
    write_atomically(os.devnull, b"x")
    assert stat.S_ISCHR(os.stat(os.devnull).st_mode)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    received: list[bytes] = []
    reader = threading.Thread(target=lambda: received.append(pipe.read_bytes()))
    reader.start()
    write_atomically(str(pipe), b"through")
    reader.join(10)
    assert received == [b"through"]
    assert names(tmp_path) == ["pipe"]


def test_a_long_name_that_is_allowed_is_written(tmp_path):
    name = "n" * 250 + ".json"
    write_atomically(str(tmp_path / name), b"x")
    assert names(tmp_path) == [name]


@pytest.mark.parametrize("path", ["missing/out.json", ".", "file/out.json", "n" * 300])
def test_what_cannot_be_written_is_named(tmp_path, monkeypatch, path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(OutputError) as refusal:
        write_atomically(path, b"x")
    assert str(refusal.value).startswith(f"{path}: ")
    assert names(tmp_path) == ["file"]


def test_standard_output_and_no_output_need_no_check(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    check_writable("-")
    check_writable(None)
    assert names(tmp_path) == []


def test_standard_output_gets_the_bytes(capsysbinary):
    write_atomically("-", b"\x00\xff")
    assert capsysbinary.readouterr().out == b"\x00\xff"


def test_a_closed_standard_output_is_an_output_error(monkeypatch):
    monkeypatch.setattr("sys.stdout", None)
    with pytest.raises(OutputError, match="standard output: is closed"):
        write_atomically("-", b"x")


def no_second_name(*_names: object) -> None:
    raise OSError(errno.EPERM, "this file system knows one name for a file")


@pytest.mark.parametrize("link", [os.link, no_second_name])
def test_what_was_written_first_stays(tmp_path, monkeypatch, link):
    path = tmp_path / "once"
    monkeypatch.setattr(os, "link", link)
    umask = os.umask(0o027)
    try:
        write_once(path, b"first")
    finally:
        os.umask(umask)
    assert path.stat().st_mode & 0o777 == 0o640
    monkeypatch.undo()
    write_once(path, b"second")
    assert path.read_bytes() == b"first"
    assert list(tmp_path.iterdir()) == [path]


def test_the_umask_is_left_alone(tmp_path, monkeypatch):
    """It is the whole process's: what another thread makes meanwhile would have the wrong rights."""
    monkeypatch.setattr(os, "umask", lambda mask: pytest.fail(f"umask({mask:o})"))
    write_atomically(str(tmp_path / "out.json"), b"x")
    write_once(tmp_path / "once", b"x")
    assert names(tmp_path) == ["once", "out.json"]
