"""Where the data files of the project lie: beside the package in a source checkout, inside it once installed."""

from pathlib import Path

import harness
from harness.errors import UnknownName

_DATA_FOLDERS = ("models", "scenarios")


def data_folder(name: str) -> Path:
    """The folder `models` or `scenarios`; UnknownName for any other or when it was not installed."""
    package = Path(harness.__file__).parent
    for folder in (package / "share" / name, package.parent / name):
        if name in _DATA_FOLDERS and folder.is_dir():
            return folder
    raise UnknownName("data folder", name, _DATA_FOLDERS)
