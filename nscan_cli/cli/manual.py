"""Exit codes, environment variables and examples, for the help and for docs/reference.md."""

from __future__ import annotations

EXIT_CODES = {
    0: "done",
    1: "internal error; please report it",
    2: "wrong usage",
    3: "done, but a requested check failed",
    65: "invalid input",
    66: "missing or unreadable input",
    73: "cannot write an output",
    130: "interrupted",
    141: "standard output was closed early",
}
ENVIRONMENT = {
    "NSCAN_CLI_OPTION": "sets --option of every command that has it, with underscores for dashes: "
    "NSCAN_CLI_THREADS=2, NSCAN_CLI_NO_ODOMETRY=1; the command line overrides it, and it overrides --config",
    "NSCAN_CLI_COMMAND_OPTION": "sets --option of one command, such as NSCAN_CLI_SLAM_RELATIONS; options "
    "with another meaning in each command have this variable only",
    "NSCAN_CLI_MAX_LIMIT": "a limit on inputs, such as NSCAN_CLI_MAX_BEAMS; error messages name the variable",
    "NO_COLOR": "if set, progress has no colours",
    "NUMBA_CACHE_DIR": "folder for compiled kernels, instead of the user's cache folder "
    "(XDG_CACHE_HOME, or ~/.cache)",
    "OPENBLAS_NUM_THREADS": "threads of linear algebra, 1 if not set (also MKL_… and OMP_…); another "
    "number can change the last digits",
}
EXAMPLES = (
    ("nscan-cli info robot.log.gz", "what a log contains"),
    ("nscan-cli slam robot.log.gz -o robot.json --map robot.png", "a pose graph, and a map of it"),
    ("nscan-cli render robot.json robot.log.gz -o figure.png --style paper", "a figure"),
    ("nscan-cli evaluate robot.json --reference truth.tum", "its errors"),
)
