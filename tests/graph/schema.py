"""The JSON Schema of saved graphs."""

from __future__ import annotations

import json
from importlib import resources
from typing import Any

import jsonschema


def schema() -> dict[str, Any]:
    text = resources.files("nscan_cli.graph.io").joinpath("pose-graph.schema.json").read_text("utf-8")
    document: dict[str, Any] = json.loads(text)
    return document


def validate(document: dict[str, Any]) -> None:
    jsonschema.Draft202012Validator(schema()).validate(document)
