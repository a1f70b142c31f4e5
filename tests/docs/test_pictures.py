from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from tests.data import REPOSITORY
from tests.experiments.output import HEIGHT, WIDTH
from tests.pictures import main


def test_pictures_of_the_sample_are_drawn_without_real_logs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NSCAN_DATA", str(tmp_path))
    monkeypatch.chdir(REPOSITORY)
    main(str(tmp_path))
    assert sorted(path.name for path in tmp_path.glob("*.png")) == ["match.png", "office.png"]
    for path in tmp_path.glob("*.png"):
        with Image.open(path) as picture:
            assert picture.width == WIDTH
            assert picture.height <= HEIGHT
            # A map or two scans: no empty page.
            assert len(picture.convert("RGB").getcolors(1 << 20) or []) > 5
