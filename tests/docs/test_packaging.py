"""What packagers, images and CI use: it names this version, and calls that the commands take."""

from __future__ import annotations

import re
import shlex
import tomllib

import click
import pytest
from ruamel.yaml import YAML

from nscan_cli import __version__
from nscan_cli.cli.main import cli
from tests.data import PACKAGE, REPOSITORY
from tests.docs.blocks import blocks

PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())
WORKFLOW = YAML(typ="safe").load(blocks("docs/deployment.md", "yaml")[0])
STEPS = [step["run"] for step in WORKFLOW["jobs"]["maps"]["steps"] if "run" in step]
DOCKERFILE = (REPOSITORY / "Dockerfile").read_text()


def test_the_citation_is_of_this_version_and_names_the_paper():
    citation = YAML(typ="safe").load((REPOSITORY / "CITATION.cff").read_text())
    assert citation["version"] == __version__
    assert citation["license"] == PROJECT["project"]["license"]
    assert citation["title"] == PROJECT["project"]["name"]
    (paper,) = citation["references"]
    assert paper["title"].startswith("nScan-Matching: ")
    assert paper["year"] == 2006


@pytest.mark.parametrize("line", [*STEPS, *re.findall(r"&& (nscan-cli .*?) \\\\", DOCKERFILE)])
def test_calls_of_ci_and_of_the_image_are_taken(line):
    tool, name, *arguments = shlex.split(line, comments=True)
    if tool == "nscan-cli":
        parent = click.Context(cli, info_name=tool)
        command = cli.get_command(parent, name)
        assert command is not None
        command.make_context(name, arguments, parent=parent)


def test_the_image_is_warm():
    """It compiles after the installation, into the folder that containers use."""
    assert DOCKERFILE.index("ENV NUMBA_CACHE_DIR=") < DOCKERFILE.index("pip install")
    assert DOCKERFILE.index("pip install") < DOCKERFILE.index("nscan-cli warm-up")
    ignored = (REPOSITORY / ".dockerignore").read_text().split()
    assert not {"nscan_cli", "man", "README.md", "LICENSE", "pyproject.toml"} & set(ignored)


def test_the_wheel_has_types_and_man_pages():
    assert (PACKAGE / "py.typed").exists()
    assert PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["shared-data"] == {"man": "share/man/man1"}
    assert "Typing :: Typed" in PROJECT["project"]["classifiers"]
