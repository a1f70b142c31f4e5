"""A map as the output of a command: its name, its cell size, and the YAML beside it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from nscan_cli.cli.picture_names import MAP_SUFFIXES, check_suffix
from nscan_cli.cli.progress import say
from nscan_cli.cli.subcommand import option
from nscan_cli.files.inputs import base_name
from nscan_cli.files.outputs import check_writable, write_atomically
from nscan_cli.files.text import path_of_name, printable

if TYPE_CHECKING:
    from nscan_cli.mapping.map_server import MapImage

resolution_option = option(
    "--resolution", type=click.FloatRange(0.001, 10), default=0.05, show_default=True, metavar="M",
    help="Cell size of the map. Smaller cells take more time and memory.",
)  # fmt: skip


def check_map_outputs(output: str, yaml: bool, written: Sequence[str] = MAP_SUFFIXES) -> None:
    """Check that a map, and its YAML, can be written.

    `written` are the suffixes that its name may have. Raises WrongUsageError and OutputError.
    """
    check_suffix(output, output, written)
    check_writable(output)
    if yaml:
        check_writable(yaml_path(output))


def write_map(output: str, image: MapImage, yaml: bool, quiet: bool, comments: Sequence[str] = ()) -> None:
    """Write a map for map_server, as PGM if its name says so, then its YAML with `comments` if `yaml`."""
    name = base_name(output)
    if yaml and path_of_name(name) != Path(output).name:
        say(
            f"warning: {printable(yaml_path(output))} names the map {name}, which no loader will find: "
            "its real name is not UTF-8, which YAML needs",
            quiet,
        )
    from nscan_cli.mapping.map_server import map_pgm, map_png, map_yaml

    as_pgm = Path(output).suffix.lower() == ".pgm"
    write_atomically(output, map_pgm(image) if as_pgm else map_png(image))
    if yaml:
        write_atomically(yaml_path(output), map_yaml(name, image, comments))


def yaml_path(output: str) -> str:
    """The path of a map's YAML."""
    return str(Path(output).with_suffix(".yaml"))
