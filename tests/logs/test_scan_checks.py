"""The options of reading are in the provenance of every graph."""

from __future__ import annotations

import ast
import dataclasses

from nscan_cli.logs.scan_checks import SCAN_CHECKS
from tests.data import PACKAGE


def test_the_provenance_has_all_options_of_reading():
    defined = {
        node.name
        for path in (PACKAGE / "logs").rglob("*.py")
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.ClassDef) and node.name.endswith("Options")
    }
    recorded = {type(getattr(SCAN_CHECKS, each.name)).__name__ for each in dataclasses.fields(SCAN_CHECKS)}
    # The provenance has the options of the user beside these.
    assert defined - {"ReadingOptions", "ScanCheckOptions"} == recorded
