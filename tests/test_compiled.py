from __future__ import annotations

import ast
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from nscan_cli import compiled
from nscan_cli.compiled import cache_folder, first_compile

KERNEL = """
import json, sys
from nscan_cli.compiled import cache_folder, first_compile, kernel
import numba
before = numba.config.CACHE_DIR
first = first_compile("add")

@kernel
def add(a, b):
    return a + b

folder = cache_folder()
values = [add(1, 2), add(1.0, 0.5)]
hits = sum(add.stats.cache_hits.values())
same = numba.config.CACHE_DIR == before
print(json.dumps([folder and str(folder), first, first_compile("add"), values, hits, same]))
"""


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
    assert first_compile("_descend")
    private.rmdir()
    (places / "elsewhere").mkdir()
    private.symlink_to(places / "elsewhere")
    assert chosen() is None


def test_a_changed_kernel_file_changes_the_folder_and_no_other_file_does(places, monkeypatch):
    package = places / "nscan_cli"
    shutil.copytree(Path(compiled.__file__).parent, package)
    monkeypatch.setattr(compiled, "__file__", str(package / "compiled.py"))
    before = chosen()
    with (package / "cli" / "main.py").open("a") as file:
        file.write("# changed\n")
    assert chosen() == before
    with (package / "mapping" / "casting.py").open("a") as file:
        file.write("# changed\n")
    assert chosen() != before


def report(**environment: str) -> list[object]:
    """What a new process says of a kernel that it compiles or loads."""
    kept = {
        key: value for key, value in os.environ.items() if key not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
    }
    script = Path(environment.pop("SCRIPT"))
    if not script.exists():
        script.write_text(KERNEL)
    done = subprocess.run(
        [sys.executable, str(script)], env={**kept, **environment}, capture_output=True, check=True,
        cwd=Path(__file__).parents[1],
    )  # fmt: skip
    answer: list[object] = json.loads(done.stdout)
    return answer


def kept_in(folder: Path) -> dict[str, str]:
    return {
        "SCRIPT": str(folder / "script.py"),
        "NUMBA_CACHE_DIR": str(folder / "cache"),
        "PYTHONPATH": str(Path(__file__).parents[1]),
    }


def test_machine_code_is_kept_between_processes(tmp_path):
    environment = kept_in(tmp_path)
    folder, first, after, values, hits, same = report(**environment)
    assert str(folder).startswith(str(tmp_path / "cache"))
    assert (first, after, values, hits, same) == (True, False, [3, 1.5], 0, True)
    assert report(**environment) == [folder, False, False, [3, 1.5], 2, True]


def test_a_full_disk_under_the_cache_stops_nothing(tmp_path):
    """No file can grow beyond 100 bytes."""
    script = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))\n{KERNEL}"
    (tmp_path / "script.py").write_text(script)
    folder, _first, _after, values, hits, _same = report(**kept_in(tmp_path))
    assert (values, hits) == ([3, 1.5], 0)
    files = [path for path in Path(str(folder)).rglob("*") if path.is_file()]
    assert not [path.name for path in files if path.stat().st_size > 100 or ".tmp." in path.name]


@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_a_damaged_cache_is_made_anew(tmp_path, suffix):
    assert report(**kept_in(tmp_path))[3:5] == [[3, 1.5], 0]
    kept = list((tmp_path / "cache").rglob(f"*.{suffix}"))
    assert kept
    for path in kept:
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert report(**kept_in(tmp_path))[3:5] == [[3, 1.5], 0]
    assert report(**kept_in(tmp_path))[3:5] == [[3, 1.5], 2]


def test_kernels_run_where_nothing_can_be_kept(places, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", unwritable(places / "file"))
    monkeypatch.setattr("tempfile.tempdir", unwritable(places / "other"))
    assert chosen() is None

    @compiled.kernel
    def twice(number: float) -> float:
        return 2 * number

    assert twice(1.5) == 3.0


def kernels() -> Iterator[tuple[str, ast.FunctionDef]]:
    """All functions of the package that are compiled."""
    for path in sorted(Path(compiled.__file__).parent.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef) and any(
                isinstance(each, ast.Name) and each.id.endswith("kernel") for each in node.decorator_list
            ):
                yield f"{path.stem}.{node.name}", node


def test_no_kernel_needs_scipy():
    """numba compiles products of matrices only where SciPy is installed, and nothing installs it."""
    found = dict(kernels())
    assert len(found) > 50
    for name, function in found.items():
        for node in ast.walk(function):
            assert not isinstance(node, ast.MatMult), name
            assert not (isinstance(node, ast.Attribute) and node.attr in ("dot", "linalg")), name
