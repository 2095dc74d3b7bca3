"""The hash of the package covers its data as well as its code."""

import shutil
from pathlib import Path

import pytest

from harness.core.package_data import PACKAGE_FOLDER, data_folder
from harness.results import manifest

PAGES = {".js", ".css", ".md", ".png", ".typed"}
compute_hash = manifest.source_hash.__wrapped__


@pytest.mark.parametrize("name", ["humanoid24/humanoid24.xml", "constellations/hall.mcf"])
def test_edited_data_never_meet_cells_of_the_old(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    models = tmp_path / "models"
    shutil.copytree(data_folder("models"), models)
    before = compute_hash()
    monkeypatch.setattr(manifest, "data_folder", lambda name: models)
    assert compute_hash() == before, "the place of the files does not matter"
    (models / name).write_bytes((models / name).read_bytes() + b"\n")
    assert compute_hash() != before


def test_every_file_of_the_package_is_hashed_but_pages_and_texts() -> None:
    hashed = set(manifest.source_files().values())
    folders = (PACKAGE_FOLDER, data_folder("models"))
    files = {file for folder in folders for file in folder.rglob("*") if file.is_file() and file.suffix not in PAGES}
    assert {file for file in files - hashed if file.parent.name != "__pycache__"} == set()
    assert {"core/files.py", "models/humanoid24/humanoid24.xml"} <= set(manifest.source_files())
