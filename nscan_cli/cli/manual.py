"""What holds for all commands and stands in the help and in docs/reference.md: exit codes, environment."""

from __future__ import annotations

EXIT_CODES = {
    0: "done",
    1: "a bug; please report it",
    2: "wrong usage",
    3: "done, but a check that was asked for failed",
    65: "bad input",
    66: "missing or unreadable input",
    73: "an output that cannot be written",
    130: "interrupted",
    141: "standard output was closed early",
}
ENVIRONMENT = {
    "NSCAN_CLI_OPTION": "sets the option --option of every command that has it, dashes as underscores: "
    "NSCAN_CLI_THREADS=2, NSCAN_CLI_NO_ODOMETRY=1; the command line goes before it, --config after it",
    "NSCAN_CLI_COMMAND_OPTION": "the same for one command alone, such as NSCAN_CLI_SLAM_RELATIONS; there "
    "is no other for options that mean another thing in another command",
    "NSCAN_CLI_MAX_LIMIT": "what an input may hold at most, such as NSCAN_CLI_MAX_BEAMS; errors name theirs",
    "NO_COLOR": "if it is set, progress has no colours",
    "NUMBA_CACHE_DIR": "the folder for compiled kernels, in place of the user's cache folder "
    "(XDG_CACHE_HOME, or ~/.cache)",
    "OPENBLAS_NUM_THREADS": "the threads of linear algebra, 1 if it is not set (also MKL_… and OMP_…); "
    "others can change the last digits",
}
EXAMPLES = (
    ("nscan-cli info robot.log.gz", "what is in a log"),
    ("nscan-cli slam robot.log.gz -o robot.json --map robot.png", "a pose graph, and a map of it"),
    ("nscan-cli render robot.json robot.log.gz -o figure.png --style paper", "a figure"),
    ("nscan-cli evaluate robot.json --reference truth.tum", "how good it is"),
)
