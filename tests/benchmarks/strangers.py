"""Files that say something wrong, mapped: `python -m tests.benchmarks.strangers OUT.md [WORD ...]`.

Each is mapped by default, with the options that the messages say to try, and with --as-recorded. With words,
only cases are run whose drive or fault contains one of them.
"""

from __future__ import annotations

import json
import os
import re
import resource
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.benchmarks.stranger_cases import Case, siblings, strangers
from tests.data import REAL_LOGS
from tests.experiments.output import table

FACTOR, MORE = 1.5, 0.002
"""A map is right up to so many times the error of the untouched drive, or so much (m) more."""
LONGEST_RUN = 120
"""s of CPU; a run that takes longer fails: where a wrong file is believed, places are searched everywhere."""
OPTION = r"--[a-z-]+(?: -?\d[^\s;,]*(?:,[^\s;,]+)*)?"
CURES = re.compile(rf"(?:try|leave out) ({OPTION}(?: {OPTION})*)|(--clock-offset \S+) corrects")
"""The options that a message says to try, as they are pasted."""


@dataclass(frozen=True)
class Run:
    """One run of `slam`."""

    error: float | None
    """m: RMSE of positions, or mean error on the relations; None if it failed."""
    said: tuple[str, ...]


@dataclass(frozen=True)
class Outcome:
    """What came of a case."""

    case: Case
    default: Run
    cure: str
    cured: Run | None
    """With the options of the message; None if it has none."""
    recorded: Run


def outcome(case: Case) -> Outcome:
    """Map a file in three ways. A file that cannot be made has failed: the others are mapped."""
    with TemporaryDirectory() as folder:
        try:
            log, reference = case.files(Path(folder))
        except Exception as error:
            failed = Run(None, (f"{type(error).__name__}: {error}",))
            return Outcome(case, failed, "", None, failed)
        slam = [str(log), "-o", str(Path(folder, "graph.json"))]
        default = _run(slam, reference)
        cure = " ".join(_cures(default.said, case.cure))
        cured = _run([*slam, *cure.split()], reference) if cure else None
        return Outcome(case, default, cure, cured, _run([*slam, "--as-recorded"], reference))


def _cures(said: Sequence[str], known: str) -> list[str]:
    """The first option of each message that says to try one; or the one that the owner knows to be right."""
    if known:
        named = (re.search(known, message) for message in said)
        return [option.group() for option in named if option][:1]
    found = [CURES.search(message) for message in said]
    return [cure.group(1) or cure.group(2) for cure in found if cure]


def _run(slam: Sequence[str], reference: Sequence[str]) -> Run:
    path = str(Path(slam[2]).with_name("path.tum"))
    mapped = _nscan_cli("slam", *slam, "--trajectory", path, "--json", "--threads", "1")
    if mapped.returncode:
        return _failed(mapped, ())
    said = tuple(json.loads(mapped.stdout)["warnings"])
    measured = _nscan_cli("evaluate", path, *reference, "--json")
    if measured.returncode:
        return _failed(measured, said)
    found = json.loads(measured.stdout)
    if "--reference" in reference:
        return Run(found["reference"]["ate"]["translation"]["rmse"], said)
    return Run(found["relations"]["translation"]["mean"], said)


def _failed(done: subprocess.CompletedProcess[str], said: tuple[str, ...]) -> Run:
    """A run without an error, with what was said before and why it failed."""
    return Run(None, (*said, done.stderr.strip().split("\n")[-1]))


def _nscan_cli(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "nscan_cli", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        resource.prlimit(process.pid, resource.RLIMIT_CPU, (LONGEST_RUN, LONGEST_RUN))
        said, problem = process.communicate()
    return subprocess.CompletedProcess(command, process.returncode, said, problem)


def verdict(outcome: Outcome, untouched: float) -> str:
    """How a stranger fares."""
    bound = max(FACTOR * untouched, untouched + MORE)
    told = any(re.search(outcome.case.cause, said) for said in outcome.default.said)
    if _within(outcome.default, bound):
        return "right" if told or not outcome.case.cause else "right, not told"
    if told:
        return "told, right with the option" if _within(outcome.cured, bound) else "told"
    return "**another cause is told**" if outcome.default.said else "**wrong and silent**"


def _within(run: Run | None, bound: float) -> bool:
    return run is not None and run.error is not None and run.error <= bound


def document(outcomes: Sequence[Outcome]) -> str:
    """The table as Markdown."""
    untouched = {each.case.drive: each.default.error for each in outcomes if not each.case.fault}
    rows = []
    for each in outcomes:
        own = untouched.get(each.case.drive) if each.case.untouched is None else each.case.untouched
        rows.append((
            each.case.drive,
            each.case.fault or "nothing",
            "–" if own is None else f"{own:.4f}",
            _metres(each.recorded),
            _metres(each.default),
            f"{_metres(each.cured)} `{each.cure}`" if each.cure else "–",
            "–" if own is None else verdict(each, own),
            _shortened(each),
        ))  # fmt: skip
    header = (
        "drive",
        "what is wrong",
        "untouched",
        "as recorded",
        "by default",
        "as the message says",
        "verdict",
        "what is said",
    )
    parts = [
        "# Files of strangers",
        "Written by `make strangers`. Files that say something wrong, made after reports of their owners, "
        "and the same faults put into a simulated drive and real logs "
        "(`tests/benchmarks/stranger_faults.py`). Errors are in m: for simulated drives the root mean "
        "square error of positions (ATE), for real logs the mean error on their relations, for fr-campus the "
        "ATE against its reference, and for urg-corridor-1 the root mean square error against the map of the "
        f"untouched drive. A map is right if its error is at most {FACTOR:g} times that of the untouched "
        f"drive, or at most {1000 * MORE:g} mm larger. The map of urg-corridor-1 differs from its own by "
        "0.024 m without odometry, by 0.031 m with a sixth of its beams masked, and by 0.043 m with every "
        "second scan: so much is lost where a "
        'fault hides as much. "As recorded" is with `--as-recorded`: the file is believed. '
        '"As the message says" is with the first option that each message names.',
        table(header, rows),
    ]
    return "\n\n".join(parts) + "\n"


def _metres(run: Run | None) -> str:
    return "–" if run is None else "fails" if run.error is None else f"{run.error:.4f}"


def _shortened(outcome: Outcome) -> str:
    """The first words of each message, the one that tells the cause first."""
    cause = outcome.case.cause
    said = sorted(outcome.default.said, key=lambda text: not (cause and re.search(cause, text)))
    return "; ".join(_clipped(text.split(":")[0].replace("|", "/")) for text in said[:2]) or "–"


def _clipped(text: str, most: int = 90) -> str:
    """A text of at most so many characters, cut between words."""
    return text if len(text) <= most else text[:most].rsplit(" ", 1)[0].rstrip(" ,;") + " …"


def main(out: str, words: Sequence[str]) -> None:
    """Map all files, two at a time; write the document."""
    data = Path(os.environ.get("NSCAN_DATA", REAL_LOGS))
    with ThreadPoolExecutor(2) as pool:
        cases = [*strangers(data), *siblings(data)]
        cases = [
            case for case in cases if not words or any(word in f"{case.drive} {case.fault}" for word in words)
        ]
        outcomes = []
        for each in pool.map(outcome, cases):
            outcomes.append(each)
            runs = _metres(each.default), each.cure, _metres(each.cured)
            print(each.case.drive, each.case.fault, *runs, *each.default.said, sep=" | ", flush=True)
            # What is done is kept if it is stopped.
            Path(out).write_text(document(outcomes), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
