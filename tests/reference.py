"""docs/reference.md and man/, made from the commands: python -m tests.reference docs/reference.md"""

from __future__ import annotations

import sys
from collections.abc import Iterable

import click

from nscan_cli.cli.main import COMMANDS, cli
from nscan_cli.cli.manual import ENVIRONMENT, EXAMPLES, EXIT_CODES
from nscan_cli.cli.subcommand import (
    ADVANCED,
    ARGUMENTS,
    COMMON,
    CONTEXT,
    OWN,
    READING,
    Argument,
    Option,
    Subcommand,
    section_of,
)
from nscan_cli.files import limits
from nscan_cli.files.limits import Limit
from nscan_cli.files.outputs import write_atomically
from nscan_cli.logs.formats import readable_forms
from tests.data import REPOSITORY
from tests.man_pages import man_pages

MAN = REPOSITORY / "man"

LIMITS = [each for each in vars(limits).values() if isinstance(each, Limit)]
HEAD = """\
# Reference

Every command of `nscan-cli` with its arguments, options, files and exit codes. This page is made from the
commands by `python -m tests.reference docs/reference.md`; do not edit it.
"""
GENERAL = f"""\
`nscan-cli COMMAND [OPTIONS] ARGUMENTS`, or `python -m nscan_cli`. Options may stand before and after
arguments. The format of a log is detected from its content, never from its name:
{readable_forms()}. `-` is standard input or output.

Scans are numbered from 0 in order of time, and have the same numbers in every command. Lengths are metres,
times seconds, angles radians in files and degrees on the command line and in tables. A pose is x, y and the
angle from the x axis to the left.

Messages go to standard error, results to files or to standard output; the tables of `info` and `evaluate` are
results. On a terminal a progress bar shows scans done, scans per second, keyframes, closed loops and the time
left. An error is one line with the file, the place and a remedy; `-vv` adds the traceback.
"""
CONFIG = """\
The value of an option comes from the command line, else from the environment, else from the TOML file of
`--config`, else it is the default. Keys in the file are long names of options without dashes. Keys at the top
apply to every command with such an option; keys in a table with a command's name apply to that command only.
Unknown keys are errors, and so are keys at the top with another meaning in each command, such as `relations`.
`--dump-config` prints the options in force in this form.

```toml
max-range = 30.0
mount = [0.1, 0, 0]      # x, y in m, degrees

[slam]
relations = "both"       # has another meaning in [evaluate]
no-loops = true
```
"""
MANIFEST = """\
The manifest of `nightly` has a table for every log. All keys except `name` are optional. Without `path`, a
log with that name and a usual suffix is looked for, or the file name of `source`. Paths are relative to the
manifest, or to `--data`. A missing log counts as failed, unless it is optional.

```toml
[[log]]
name = "intel"
path = "intel.log.gz"                      # or also = ["intel-lab"], other names to look for
optional = true                            # skipped if missing; not evaluated without reference
relations = "intel.relations"              # or reference = "intel.tum", or a log with TRUEPOS
max_translation = 0.02                     # m; a larger error fails the log
max_rotation = 0.4                         # degrees
published = { "Cartographer" = 0.0229 }    # m, shown beside ours
parameters = { end = 600, max-scans = 8 }  # options of slam and of reading, by their long names
source = "http://example.org/intel.clf"    # download address, printed if it is missing
relations_source = "http://example.org/intel.relations"
sha256 = "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"  # of the log that bounds are for
```

`reference_source`, `relations_sha256` and `reference_sha256` are likewise. `about` and `published_map` (an
address) are for the report.
"""
FILES = """\
Files are written atomically: first under a name that begins with `.nscan-cli.` in the same folder, then
renamed. Folders are not created, except that of `nightly`. The next run removes temporary files of a killed
run.
"""
WRITTEN = (
    ("GRAPH.json", "`slam -o`", "the pose graph, described by the JSON Schema that it names; read by "
     "`render`, `evaluate`, `nscan`, `slam --from`"),
    ("MAP.png or MAP.pgm, MAP.yaml", "`slam --map`, `render -o`", "8-bit gray (0 occupied, 205 unknown, 254 "
     "free), its place and its scale, for map_server and Nav2"),
    ("MAP.html", "`render -o`", "a page for browsers, complete in itself: the map to zoom and to measure in, "
     "path by time, scans, graph, loops with reasons, uncertainty and notices"),
    ("OUT.tum", "`slam --trajectory`, `render --poses`", "`t x y z qx qy qz qw`, the pose of every scan"),
    ("OUT.g2o", "`slam --g2o`", "`VERTEX_SE2`, `EDGE_SE2` and `FIX` for the keyframes"),
    ("OUT.log", "`slam --carmen`", "CARMEN text: the log with corrected poses"),
    ("OUT.mcap", "`render --mcap`", "a ROS 2 recording: `/map`, `/path`, `/graph`, `/scan`, "
     "`/tf`, `/tf_static`"),
    ("RESULT.json", "`match`, `nscan`", "poses, Hessian and covariance; matrices as upper "
     "triangles, row by row"),
    ("PICTURE.png", "`--plot`, `--removed`, `render` for people", "a picture in colour, of 300 dots an "
     "inch: the plot of `--style paper` is 20 cm long in print, its text of 10 points"),
    ("FILE", "`slam --depfile`", "`outputs: inputs` for `include` in a Makefile"),
    ("FOLDER", "`nightly -o`", "report.html, report.json, and for each log a folder with graph, trajectory, "
     "map, page and history"),
    ("~/.cache/nscan-cli", "all that match", "compiled kernels; can be deleted, but kernels that are "
     "compiled again can round differently"),
)  # fmt: skip
RESULTS = """\
The keys of the results of `match` and `nscan`, in m and rad. A matrix is given by its upper triangle, row by
row: a covariance of x, y and the angle is `[xx, xy, xθ, yy, yθ, θθ]`.
"""
KEYS = (
    ("format, version, units, provenance", "both",
     "type and version of the document, and the logs and parameters that it was made from"),
    ("reference, scan", "`match`", "the numbers of the scans I and J"),
    ("initial", "`match`", "the initial pose"),
    ("pose", "`match`", "of J in the frame of I"),
    ("relation", "`nscan`",
     "as in a graph, with `scans` instead of `nodes`: `poses` in a local frame, `hessian` with the gauge, "
     "and `fixed`, the index of the fixed scan"),
    ("covariance", "both",
     "of the pose; for `nscan` of the other scans' poses, in their order, relative to the fixed scan; null "
     "if the Hessian is singular"),
    ("energy", "both", "E of eqs. (3) and (4), neither scaled nor with priors"),
    ("gradient_norm", "both", "of the objective: E scaled to a negative log likelihood, with priors"),
    ("hessian, eigenvalues", "`match`", "of the objective, at the pose"),
    ("decrement", "both", "the remaining Newton step, in standard deviations"),
    ("iterations, evaluations", "both",
     "of all stages and all attempts; the parameter `max_iterations` is for one stage"),
    ("unsettled_stages", "both",
     "number of stages before the last that did not converge within their iterations: the result may be a "
     "wrong local minimum"),
    ("searched", "`nscan`", "whether the initial poses come from a search"),
    ("converged, reason", "both",
     "whether the last stage, of the energy itself, reached a minimum, and if not, why"),
    ("pairs", "`nscan`", "the pairs of scans that were matched"),
    ("overlap", "both", "the fraction of a scan's points that lie on the other scan, or on any other"),
    ("weakest", "both",
     "the direction (rad) in which the translation is least certain, and the standard deviation (m) along "
     "it, null if it is undetermined; for `nscan` of each scan, without priors"),
    ("left_out", "`nscan`",
     "the scans that are not in the relation, with `reason`, `overlap`, and χ² against priors (`chi2`)"),
)  # fmt: skip
COMPLETION = """\
These lines enable completion of commands, options, choices and file names; put one into the file in its
comment (bash from 4.4):

```sh
eval "$(_NSCAN_CLI_COMPLETE=bash_source nscan-cli)"    # ~/.bashrc
eval "$(_NSCAN_CLI_COMPLETE=zsh_source nscan-cli)"     # ~/.zshrc, after compinit
_NSCAN_CLI_COMPLETE=fish_source nscan-cli | source     # ~/.config/fish/completions/nscan-cli.fish
```
"""


def reference() -> str:
    """The page, Markdown with a final line feed."""
    context = click.Context(cli, info_name="nscan-cli")
    commands = {name: _command(context, name) for name in COMMANDS}
    first = commands["info"]
    titles = ["All commands", *(f"nscan-cli {name}" for name in COMMANDS), READING, ADVANCED, COMMON,
              "Exit codes", "Environment", "Settings in a file", "Manifest", "Files",
              "Results of match and nscan", "Completion"]  # fmt: skip
    parts = [
        HEAD,
        "".join(f"- [{title}](#{title.lower().replace(' ', '-')})\n" for title in titles),
        "## All commands\n\n" + GENERAL,
        _examples(EXAMPLES),
        *(_chapter(context, command) for command in commands.values()),
        f"## {READING}\n\nOptions of the commands that read a log.\n\n" + _options(first, READING),
        f"## {ADVANCED}\n\nReading a log: options that are seldom needed.\n\n" + _options(first, ADVANCED),
        f"## {COMMON}\n\n" + _options(first, COMMON),
        "## Exit codes\n\n" + _table(("code", "meaning"), ((str(c), m) for c, m in EXIT_CODES.items())),
        "## Environment\n\n" + _table(("variable", "what it does"), _variables()),
        "## Settings in a file\n\n" + CONFIG,
        "## Manifest\n\n" + MANIFEST,
        "## Files\n\n" + FILES,
        _table(("file", "by", "what"), WRITTEN),
        "## Results of match and nscan\n\n" + RESULTS,
        _table(("key", "of", "what it is"), ((_keys(keys), of, what) for keys, of, what in KEYS)),
        "## Completion\n\n" + COMPLETION,
    ]
    return "\n".join(parts)


def _command(context: click.Context, name: str) -> Subcommand:
    command = cli.get_command(context, name)
    assert isinstance(command, Subcommand)
    return command


def _context(command: Subcommand, parent: click.Context | None = None) -> click.Context:
    return click.Context(command, info_name=command.name, parent=parent, **CONTEXT)


def _chapter(parent: click.Context, command: Subcommand) -> str:
    """All of one command; options that others have too stand in chapters of their own."""
    context = _context(command, parent)
    assert command.help is not None
    shared = [
        f"[{title}](#{title.lower().replace(' ', '-')})"
        for title in (READING, ADVANCED, COMMON)
        if command.records(context, title)
    ]
    parts = [
        f"## nscan-cli {command.name}\n",
        f"`{command.get_usage(context).removeprefix('Usage: ')}`\n",
        "\n\n".join(" ".join(part.split()) for part in command.help.split("\n\n")) + "\n",
        _table(
            ("argument", "what it is"),
            (_code_first(command.records(context, ARGUMENTS))),
        ),
        _options(command, OWN),
        f"And the options of {', '.join(shared)}.\n",
        _examples(command.examples),
    ]
    return "\n".join(parts)


def _keys(names: str) -> str:
    return ", ".join(f"`{name}`" for name in names.split(", "))


def _code_first(rows: Iterable[tuple[str, str]]) -> Iterable[tuple[str, str]]:
    return ((f"`{name}`", meaning) for name, meaning in rows)


def _options(command: Subcommand, section: str) -> str:
    """The table of a section's options; the names of their variables follow from theirs."""
    context = _context(command)
    rows = []
    for parameter in command.get_params(context):
        if section_of(parameter) != section or isinstance(parameter, Argument):
            continue
        assert isinstance(parameter, click.Option)
        record = parameter.get_help_record(context)
        assert record is not None
        extra = parameter.get_help_extra(context)
        limits = "required" if "required" in extra else extra.get("range", "")
        default = extra.get("default", "")
        variable = f"`{parameter.variables(context)[-1]}`" if isinstance(parameter, Option) else ""
        rows.append((f"`{record[0]}`", default, limits, parameter.help or "", variable))
    return _table(("option", "default", "values", "what it does", "variable"), rows)


def _variables() -> Iterable[tuple[str, str]]:
    yield from _code_first(ENVIRONMENT.items())
    for limit in LIMITS:
        yield f"`{limit.variable}`", f"at most {_shown(limit)}; see [limits](limits.md)"


def _shown(limit: Limit) -> str:
    """The default, whatever is set where this page is made."""
    number = f"{limit.default:,.0f}" if limit.default < 1e9 else f"{limit.default:g}"
    return f"{number} {limit.unit}".strip()


def _examples(examples: Iterable[tuple[str, str]]) -> str:
    lines = "".join(f"# {purpose}\n{line}\n" for line, purpose in examples)
    return f"```sh\n{lines}```\n"


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, tuple("---" for _ in head), *rows]
    return "".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |\n" for line in lines)


if __name__ == "__main__":
    write_atomically(sys.argv[1], reference().encode())
    for name, page in man_pages().items():
        write_atomically(str(MAN / name), page.encode())
