"""Data files are found in a checkout and in an installed package."""

from pathlib import Path

import pytest

from harness.core import package_data
from harness.core.package_data import data_folder
from harness.errors import UnknownName


def test_models_lie_in_the_checkout() -> None:
    assert (data_folder("models") / "humanoid24" / "humanoid24.xml").is_file()


def test_an_installed_package_brings_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "site-packages" / "harness"
    (package / "share" / "models").mkdir(parents=True)
    (package.parent / "models").mkdir()  # some other package's
    monkeypatch.setattr(package_data, "PACKAGE_FOLDER", package)
    assert data_folder("models") == package / "share" / "models"
    with pytest.raises(UnknownName):
        data_folder("scenarios")


def test_nothing_else_is_shared() -> None:
    with pytest.raises(UnknownName, match=r"[Dd]id you mean 'models'"):
        data_folder("model")
    with pytest.raises(UnknownName):
        data_folder("tests")
