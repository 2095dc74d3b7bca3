"""The version of the package, and where its files lie: beside it in a source checkout, inside it once installed."""

from pathlib import Path

from harness.errors import UnknownName

VERSION = "0.1.0"
"""Version of the package, as in pyproject.toml."""
PACKAGE_FOLDER = Path(__file__).parents[1]
"""The folder `harness` with the source."""
_DATA_FOLDERS = ("models", "scenarios")


def data_folder(name: str) -> Path:
    """The folder `models` or `scenarios`; UnknownName for any other, and for one that was not installed."""
    for folder in (PACKAGE_FOLDER / "share" / name, PACKAGE_FOLDER.parent / name):
        if name in _DATA_FOLDERS and folder.is_dir():
            return folder
    raise UnknownName("data folder", name, _DATA_FOLDERS)
