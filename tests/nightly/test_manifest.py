from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from nscan_cli.errors import InputDataError, InputMissingError, WrongUsageError
from nscan_cli.nightly.manifest import ManifestEntry, bundled_manifests, read_manifest
from nscan_cli.nightly.manifest_parameters import parameters_from

INTEL = """
[[log]]
name = "intel"
path = "logs/intel.log.gz"
relations = "intel.relations"
max_translation = 0.02
published = { "Cartographer" = 0.0229, "RBPF" = 0.070 }
"""


def read(tmp_path: Path, text: str, data: str | None = None) -> list[ManifestEntry]:
    (tmp_path / "night.toml").write_text(text)
    return read_manifest(str(tmp_path / "night.toml"), data)


def test_a_log_with_paths_relative_to_the_manifest(tmp_path):
    (entry,) = read(tmp_path, INTEL)
    assert entry.name == "intel"
    assert entry.inputs == {
        "log": tmp_path / "logs" / "intel.log.gz",
        "relations": tmp_path / "intel.relations",
    }
    assert (entry.max_translation, entry.max_rotation) == (0.02, None)
    assert entry.published == {"Cartographer": 0.0229, "RBPF": 0.07}
    assert not entry.is_there


def test_paths_relative_to_data(tmp_path):
    data = tmp_path / "data"
    with pytest.raises(InputMissingError, match="is not a folder"):
        read(tmp_path, INTEL, str(data))
    data.mkdir()
    (entry,) = read(tmp_path, INTEL, str(data))
    assert entry.inputs["log"] == data / "logs" / "intel.log.gz"


@pytest.mark.parametrize("file", ["aces.clf", "aces.log.gz", "aces.mcap", "aces.db3", "aces"])
def test_a_log_by_its_name_alone(tmp_path, file):
    (tmp_path / file).touch()
    (tmp_path / "aces.relations").touch()
    (entry,) = read(tmp_path, '[[log]]\nname = "aces"')
    assert entry.inputs == {"log": tmp_path / file}
    assert entry.is_there


@pytest.mark.parametrize("file", ["b-2.log.gz", "run02.log.gz", "run02.log", "run02.log.gz.no"])
def test_a_log_by_another_of_its_names_or_as_its_source_calls_it(tmp_path, file):
    (tmp_path / file).touch()
    text = 'name = "b"\nalso = ["b_two", "b-2"]\nsource = "https://example.org/1721.1/62281/run02.log.gz?x=2"'
    (entry,) = read(tmp_path, f"[[log]]\n{text}")
    assert entry.inputs["log"] == tmp_path / (file if entry.is_there else "b.log.gz")
    assert entry.is_there == (file != "run02.log.gz.no")


@pytest.mark.parametrize("file", ["b.relations", "b-2.relations", "named.relations"])
def test_relations_under_a_name_of_the_log(tmp_path, file):
    (tmp_path / file).touch()
    text = '[[log]]\nname = "b"\nalso = ["b-2"]\nrelations = "named.relations"'
    (entry,) = read(tmp_path, f"{text}\noptional = true")
    assert entry.inputs["relations"] == tmp_path / file
    # What somebody has named for a log of his own is meant.
    (entry,) = read(tmp_path, text)
    assert entry.inputs["relations"] == tmp_path / "named.relations"


def test_what_is_known_of_a_log(tmp_path):
    assert not read(tmp_path, INTEL)[0].optional
    text = 'name = "b"\noptional = true\nabout = "A hall."\npublished_map = "https://example.org/b.png"'
    (entry,) = read(tmp_path, f"[[log]]\n{text}")
    assert (entry.optional, entry.about) == (True, "A hall.")
    assert entry.published_map == "https://example.org/b.png"


def test_parameters_as_a_table(tmp_path):
    table = {"mount": [0.1, 0.0, 90.0], "angle-min": -90.0, "no-odometry": True, "max-scans": 4, "laser": "R",
             "mask": "130:150,-150:-130"}  # fmt: skip
    parameters = parameters_from("", table)
    assert parameters.as_table() == table
    assert json.loads(json.dumps(parameters.as_table())) == table
    assert parameters_from("", {"every": 1, "no-odometry": False}).as_table() == {}


def test_a_mask_with_a_range_as_a_table():
    table = {"mask": "130:150,-150:-130@1.5"}
    assert parameters_from("", table).as_table() == table


def test_parameters_are_options_of_slam(tmp_path):
    parameters = "parameters = { mount = [0.1, 0, 90], angle-min = -90, no-odometry = true, max-scans = 4 }"
    (entry,) = read(tmp_path, f'[[log]]\nname = "a"\n{parameters}')
    assert entry.parameters.reading.mount == (0.1, 0.0, math.pi / 2)
    assert entry.parameters.reading.angle_min == -math.pi / 2
    assert entry.parameters.reading.odometry is False
    assert entry.parameters.mapping == {"max-scans": 4}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[log]\n", "night.toml: not TOML: .*; mend it"),
        ("", "night.toml: has no logs; add a"),
        ("log = 3", "night.toml: has no logs"),
        ("[[logs]]", "night.toml: has an unknown key 'logs'; a manifest has"),
        ("[[log]]", "night.toml, log 1: has no name; use letters"),
        ('[[log]]\nname = "../up"', "log 1: '../up' is not a name"),
        ('[[log]]\nname = "Report.html"', "'Report.html' is not a name"),
        ('[[log]]\nname = "a"\npth = "x"', r"log 1 \(a\): has an unknown key 'pth'; known: name, path"),
        ('[[log]]\nname = "a"\n[[log]]\nname = "A"', "two logs have the name A; rename one"),
        ('[[log]]\nname = "a"\npath = 3', "path is 3; give a text"),
        ('[[log]]\nname = "a"\noptional = "yes"', "optional is 'yes'; give true or false"),
        ('[[log]]\nname = "a"\nalso = ["../b"]', "also is .*; give names of files without their endings"),
        (
            '[[log]]\nname = "a"\nrelations = "r"\nmax_translation = -1',
            "max_translation is -1; give a number",
        ),
        ('[[log]]\nname = "a"\nrelations = "r"\nmax_rotation = nan', "max_rotation is nan; give a number"),
        (
            '[[log]]\nname = "a"\nmax_rotation = 1',
            "has max_rotation, but neither relations nor reference; add",
        ),
        ('[[log]]\nname = "a"\nrelations = "r"\nreference = "t"', "has relations and reference; remove one"),
        ('[[log]]\nname = "a"\nrelations = "r"\npublished = { x = "1" }', "published is .*; give errors in"),
        ('[[log]]\nname = "a"\nsha256 = "12"', "sha256 is '12'; give 64 hexadecimal digits"),
        ('[[log]]\nname = "a"\nrelations_source = "x"', "has relations_source, but no relations; add"),
        (
            '[[log]]\nname = "a"\nparameters = { topics = "x" }',
            "unknown key 'topics'; known: allow-corrected",
        ),
        ('[[log]]\nname = "a"\nparameters = { end = "x" }', "parameters: end is 'x'; give a number"),
        ('[[log]]\nname = "a"\nparameters = { flip = 1 }', "parameters: flip is 1; give true or false"),
        ('[[log]]\nname = "a"\nparameters = { max-scans = 2 }', "max-scans is 2; give 3 or more"),
        ('[[log]]\nname = "a"\nparameters = { relations = "x" }', "give one of pairwise, nscan, both"),
        ('[[log]]\nname = "a"\nparameters = { mask = "13" }', "mask is '13'; give FROM:TO,"),
        ('[[log]]\nname = "a"\nparameters = { mask = [[1, 2]] }', r"mask is \[\[1, 2\]\]; give a text"),
        ('[[log]]\nname = "a"\nparameters = { mount = [1] }', r"mount is \[1\]; give \[x, y, degrees\]"),
        ('[[log]]\nname = "a"\nparameters = { start = 9, end = 5 }', "parameters: --start is after --end"),
    ],
)
def test_a_mistake_is_named_with_its_place_and_a_remedy(tmp_path, text, message):
    with pytest.raises(InputDataError, match=message) as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_a_manifest_that_is_not_there(tmp_path):
    with pytest.raises(InputMissingError, match="no such file"):
        read_manifest(str(tmp_path / "night.toml"), None)


@pytest.mark.parametrize("name", ["kuemmerle", "radish"])
def test_shipped_manifests_say_where_to_get_every_file(tmp_path, name):
    with pytest.raises(WrongUsageError, match="--data"):
        read_manifest(name, None)
    entries = read_manifest(name, str(tmp_path))
    assert all(entry.inputs["log"].parent == tmp_path for entry in entries)
    assert all(set(entry.sources) == set(entry.inputs) for entry in entries)
    assert all(not entry.is_there for entry in entries)
    assert all(entry.optional for entry in entries)


def test_the_manifest_of_radish_has_the_logs_under_their_names_and_those_of_downloads(tmp_path):
    names = {"intel_lab": "intel.log.gz", "usc-sal200-021120": "run02.log.gz", "albert-b-laser":
             "albertb.sm.log.gz", "intel_oregon": "intel-01-sorted.log.gz", "aces": "aces_publicb.log.gz",
             "nsh_level_a": "nsh_level_a.log.gz", "stanford-gates1": "stanford-gates1.log"}  # fmt: skip
    for file in names.values():
        (tmp_path / file).touch()
    entries = {entry.name: entry for entry in read_manifest("radish", str(tmp_path))}
    assert len(entries) >= 15
    assert {name: entries[name].inputs["log"].name for name in names} == names
    assert all(entry.about for entry in entries.values())


def test_the_manifests_that_are_shipped():
    assert set(bundled_manifests()) == {"kuemmerle", "radish"}
