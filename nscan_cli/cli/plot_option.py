"""The option --plot of several commands: a picture in addition to the result."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from nscan_cli.cli.picture_names import check_suffix
from nscan_cli.cli.shared_options import Command
from nscan_cli.cli.subcommand import PATH, option
from nscan_cli.errors import WrongUsageError
from nscan_cli.files.outputs import check_writable, write_atomically

if TYPE_CHECKING:
    from PIL.Image import Image


def plot_option(shows: str) -> Callable[[Command], Command]:
    """The option --plot; `shows` describes the picture."""
    return option("--plot", type=PATH, metavar="PICTURE.png", help=f"Draw {shows}, as a PNG.")


def check_second_output(name: str, path: str | None, others: Sequence[str | None]) -> None:
    """Check that the output of the option `name` can be written, and replaces no other file of the command.

    Raises WrongUsageError and OutputError.
    """
    if path is None:
        return
    if path == "-":
        raise WrongUsageError(f"{name} -: only the result can go to standard output; name a file")
    if os.path.realpath(path) in (os.path.realpath(other) for other in others if other and other != "-"):
        raise WrongUsageError(f"{name} {path}: is another file of this command; choose another name")
    check_writable(path)


def check_second_outputs(outputs: Mapping[str, str | None], others: Sequence[str | None]) -> None:
    """Check the outputs of several options, by their names; none may replace another either."""
    taken = list(others)
    for name, path in outputs.items():
        check_second_output(name, path, taken)
        taken.append(path)


def check_plot(plot: str | None, others: Sequence[str | None]) -> None:
    """Check the output --plot, and that its name is that of a PNG."""
    check_second_output("--plot", plot, others)
    if plot is not None:
        check_suffix(f"--plot {plot}", plot)


def write_plot(plot: str, picture: Image) -> None:
    """Write the picture atomically. Raises OutputError."""
    from nscan_cli.mapping.figures.canvas import figure_png

    write_atomically(plot, figure_png(picture))
