"""Where the kernels' machine code is kept."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from nscan_cli.kernels import cache_folder as folders
from nscan_cli.kernels.cache_folder import cache_folder
from nscan_cli.kernels.decorators import kernel
from nscan_cli.kernels.machine_code import is_uncompiled


@pytest.fixture
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """No cache folder is chosen yet, and none is configured but a home and a folder of temporary files."""
    for variable in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(variable, raising=False)
    (tmp_path / "home").mkdir()
    (tmp_path / "temporary").mkdir()
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    cache_folder.cache_clear()
    yield tmp_path
    cache_folder.cache_clear()


def chosen() -> Path | None:
    cache_folder.cache_clear()
    return cache_folder()


def unwritable(path: Path) -> str:
    """A path below a file: not even root can make a folder of it."""
    path.write_bytes(b"")
    return str(path / "below")


def test_the_users_cache_folder_is_the_place(places, monkeypatch):
    folder = chosen()
    assert folder is not None
    assert folder.parent == places / "home" / ".cache" / "nscan-cli"
    monkeypatch.setenv("XDG_CACHE_HOME", str(places / "xdg"))
    folder = chosen()
    assert folder is not None
    assert folder.parent == places / "xdg" / "nscan-cli"


def test_a_configured_place_goes_first(places, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(places / "xdg"))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(places / "numba"))
    folder = chosen()
    assert folder is not None
    assert folder.parent == places / "numba" / "nscan-cli"
    assert not (places / "xdg").exists()


def test_where_no_cache_can_be_written_a_private_temporary_folder_is_used(places, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", unwritable(places / "file"))
    folder = chosen()
    private = places / "temporary" / f"nscan-cli-{os.getuid()}"
    assert folder is not None
    assert folder.parent == private
    assert private.stat().st_mode & 0o077 == 0


def test_a_temporary_folder_that_others_can_write_is_not_trusted(places, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", unwritable(places / "file"))
    private = places / "temporary" / f"nscan-cli-{os.getuid()}"
    private.mkdir()
    private.chmod(0o777)
    assert chosen() is None
    assert is_uncompiled("descend")
    private.rmdir()
    (places / "elsewhere").mkdir()
    private.symlink_to(places / "elsewhere")
    assert chosen() is None


def test_a_changed_kernel_file_changes_the_folder_and_no_other_file_does(places, monkeypatch):
    package = places / "nscan_cli"
    shutil.copytree(folders.PACKAGE, package)
    monkeypatch.setattr(folders, "PACKAGE", package)
    before = chosen()
    with (package / "cli" / "main.py").open("a") as file:
        file.write("# changed\n")
    assert chosen() == before
    for maker in ("mapping/ray_casting.py", "kernels/machine_code.py", "slam/frontend/options.py"):
        with (package / maker).open("a") as file:
            file.write("# changed\n")
        assert chosen() not in (None, before)
        before = chosen()


def made_by(package: Path, folder: Path) -> Path:
    """A cache folder as the package at this place has left it."""
    (folder / "below_0a1b").mkdir(parents=True)
    compiled = f"{folders.COMPILED_FILE}-0123456789abcdef"
    below = ("below_0a1b/f-1.py311.nbi", "below_0a1b/f-1.py311.1.nbc")
    for name in ("a.b-01.code", "a.c-01.left", compiled, folders.LOCK_FILE, *below):
        (folder / name).write_bytes(b"x")
    (folder / folders.OWNER_FILE).write_bytes(os.fsencode(package))
    return folder


def test_a_new_folder_takes_the_place_of_those_that_nobody_needs(places):
    """But not of what another copy of the package uses, and of what is not the cache's."""
    base, elsewhere = places / "home" / ".cache" / "nscan-cli", places / "elsewhere"
    elsewhere.mkdir()
    own = made_by(folders.PACKAGE, base / "0.1.0-00000000000000aa")
    gone = made_by(places / "gone", base / "0.1.0-00000000000000ab")
    old = made_by(folders.PACKAGE, base / "0.0.9-00000000000000ac")
    (old / folders.OWNER_FILE).unlink()
    unused, used = (made_by(elsewhere, base / f"1.2.3rc1-00000000000000a{k}") for k in "de")
    long_ago = time.time() - 31 * 86400
    os.utime(unused / folders.OWNER_FILE, (long_ago, long_ago))
    mixed = made_by(places / "gone", base / "0.1.0-00000000000000af")
    (mixed / "below_0a1b" / "notes.txt").write_text("mine")
    strangers = [made_by(places / "gone", base / "src"), made_by(places / "gone", places / "linked")]
    link = base / "0.1.0-00000000000000b0"
    link.symlink_to(places / "linked")

    def files(folder: Path) -> int:
        return sum(path.is_file() for path in folder.rglob("*"))

    folder = chosen()
    assert folder is not None
    assert not any(path.exists() for path in (own, gone, old, unused))
    assert [path for path in mixed.rglob("*") if path.is_file()] == [mixed / "below_0a1b" / "notes.txt"]
    assert [files(path) for path in (used, *strangers)] == [7, 7, 7]
    assert link.is_symlink()
    # The folder is there: whatever comes beside it is left alone.
    made_by(folders.PACKAGE, own)
    assert chosen() == folder
    assert files(own) == 7


def test_a_folder_that_is_used_says_so(places):
    folder = chosen()
    assert folder is not None
    owner = folder / folders.OWNER_FILE
    assert owner.read_bytes() == os.fsencode(folders.PACKAGE)
    before = owner.stat().st_mtime
    chosen()
    assert owner.stat().st_mtime == before
    os.utime(owner, (before - 2 * 86400, before - 2 * 86400))
    chosen()
    assert owner.stat().st_mtime >= before


def test_kernels_run_where_nothing_can_be_kept(places, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", unwritable(places / "file"))
    monkeypatch.setattr("tempfile.tempdir", unwritable(places / "other"))
    assert chosen() is None

    @kernel
    def twice(number: float) -> float:
        return 2 * number

    assert twice(1.5) == 3.0
