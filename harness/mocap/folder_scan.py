"""Files of a motion library, with symbolic links followed inside the library's folder only."""

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from harness.core.files import TEMPORARY

FETCHED = ".fetch-"
"""Prefix of the names of folders of `harness mocap fetch`, which hold files before they are checked."""


@dataclass(frozen=True)
class FolderScan:
    """What a folder holds, at any depth."""

    files: tuple[Path, ...]
    """Files with one of the suffixes, sorted; links to files inside the folder are among them."""
    ignored_paths: tuple[Path, ...]
    """Links that lead outside the folder or to nothing, and folders that cannot be read, sorted."""


def scan_folder(folder: Path, suffixes: Collection[str]) -> FolderScan:
    """Search a folder for files with lower-case `suffixes` such as ".amc".

    A link to a folder inside is not walked again: its files are found where they lie, so loops of links are harmless.
    """
    top = folder.resolve()
    files, ignored, waiting = [], [], [top]
    while waiting:
        parent = waiting.pop()
        try:
            paths = list(parent.iterdir())
        except PermissionError:
            ignored.append(parent)
            continue
        for path in paths:
            if path.name.startswith((TEMPORARY, FETCHED)):
                continue  # a process writes there, or was killed while it did
            link = path.is_symlink()
            if link and not (path.exists() and path.resolve().is_relative_to(top)):
                ignored.append(path)
            elif path.is_dir():
                waiting += [] if link else [path]
            elif path.suffix.lower() in suffixes and path.is_file():
                files.append(path)
    return FolderScan(tuple(sorted(files)), tuple(sorted(ignored)))
