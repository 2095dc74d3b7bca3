"""Contact sheets: a picture of the size the documentation can carry, and the committed ones are of every behaviour."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from harness.errors import BadInput
from harness.mocap import synthetic

DOCS = Path(__file__).parents[3] / "docs" / "performer"
contact_sheet = runpy.run_path(str(DOCS / "contact_sheet.py"))["contact_sheet"]


def test_a_sheet_shows_figures_of_both_sides(tmp_path: Path) -> None:
    clip = synthetic.generate("boxing", "p1", 1, seed=3, duration_s=4.0)
    path = tmp_path / "sheet.png"
    contact_sheet(clip, path, start_s=0.5, every_s=0.25, figures=6, rows=2)
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB"), dtype=float).reshape(-1, 3)
        assert image.width > 600
    for left_or_right in ((0x1F, 0x6F, 0xB2), (0xC8, 0x45, 0x2D)):
        assert np.mean(np.abs(pixels - left_or_right).sum(axis=1) < 30.0) > 0.01


def test_a_sheet_beyond_the_clip_is_refused(tmp_path: Path) -> None:
    clip = synthetic.generate("golf", "p1", 1, seed=3, duration_s=2.0)
    with pytest.raises(BadInput, match="fewer figures"):
        contact_sheet(clip, tmp_path / "sheet.png", start_s=0.5, every_s=0.5)


@pytest.mark.parametrize("behaviour", synthetic.BEHAVIOURS)
def test_the_documentation_shows_every_behaviour(behaviour: str) -> None:
    path = DOCS / f"{behaviour}.png"
    assert 20_000 < path.stat().st_size < 250_000
