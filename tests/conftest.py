"""Settings of all tests, and a night that tests of several packages look at."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import settings

# The suite draws the same examples in each run, `make soak` others. No test looks at a clock: with the first
# example kernels may be compiled.
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.register_profile("random", deadline=None, max_examples=1000)
settings.load_profile("repeatable")


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A manifest over three small logs."""
    from tests.nightly.small_logs import write_logs

    return write_logs(tmp_path_factory.mktemp("small"))


@pytest.fixture(scope="session")
def undisturbed(small: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a first night over them; not to be changed."""
    from nscan_cli.cli.main import run

    folder = tmp_path_factory.mktemp("undisturbed") / "nights"
    assert run(["nightly", str(small), "-o", str(folder), "--jobs", "2", "-q"]) == 0
    return folder
