"""The scans of a joint match on the command line: `10,12,14-20`, `100-190:10`."""

from __future__ import annotations

import re
from typing import Any

import click

SPEC_PART = re.compile(r"(\d+)(?:-(\d+)(?::(\d+))?)?")
MOST_SCANS = 500
"""The Hessian grows with the square of the number of scans; a longer list is taken for a typing error."""


class ScanSpecType(click.ParamType[Any]):
    """Converts a list of scan numbers and ranges to a tuple of scan numbers."""

    name = "SPEC"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Parse the scan numbers; another form, a single scan and a repeated scan are usage errors."""
        scans: list[int] = []
        for part in value.split(","):
            match = SPEC_PART.fullmatch(part.strip())
            if match is None:
                self.fail(f"{part!r} is not of the form 10, 14-20 or 100-190:10", param, ctx)
            first, last, step = int(match[1]), int(match[2] or match[1]), int(match[3] or 1)
            if last < first:
                self.fail(f"{part!r} runs backwards", param, ctx)
            if step == 0:
                self.fail(f"{part!r} has a step of 0", param, ctx)
            chosen = range(first, last + 1, step)
            if len(chosen) > MOST_SCANS - len(scans):
                self.fail(f"{value!r} has more than {MOST_SCANS} scans", param, ctx)
            scans += chosen
        if len(scans) < 2:
            self.fail(f"{value!r} has only one scan; give two or more", param, ctx)
        if len(set(scans)) < len(scans):
            twice = next(scan for at, scan in enumerate(scans) if scan in scans[:at])
            self.fail(f"{value!r} has scan {twice} twice", param, ctx)
        return tuple(scans)
