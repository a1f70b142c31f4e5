"""`nscan-cli schema`: the JSON Schema of the graph file."""

from __future__ import annotations

from nscan_cli.cli.shared_options import common_options
from nscan_cli.cli.subcommand import PATH, option, subcommand


@subcommand(
    "schema",
    ("nscan-cli schema", "the schema on standard output"),
    ("nscan-cli schema -o pose-graph.schema.json", "in a file"),
)
@option("-o", "--output", type=PATH, default="-", metavar="SCHEMA.json",
        help="File for the schema. Default: standard output.")  # fmt: skip
@common_options
def command(output: str, **_verbosity: int) -> None:
    """Print the JSON Schema (draft 2020-12) of the graphs that slam writes.

    docs/graph.md describes every key.
    """
    from importlib.resources import files

    from nscan_cli.files.outputs import write_atomically

    write_atomically(output, (files("nscan_cli.graph.io") / "pose-graph.schema.json").read_bytes())
