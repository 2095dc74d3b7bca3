"""Skeletons of the people in a motion library: one of 24 bones for every subject with an ASF file."""

from pathlib import Path

import numpy as np

from harness.core.humanoid24 import BONES
from harness.core.skeleton import Skeleton
from harness.errors import BadFile, BadInput, UnknownName
from harness.mocap.folder_scan import scan_folder
from harness.mocap.library import LibraryFolders, as_folders
from harness.mocap.read.asf import read_asf


def read_skeletons(folders: LibraryFolders) -> dict[str, Skeleton]:
    """Skeleton of each subject [m], sorted by subject, from the ASF files in one or several folders at any depth.

    A file is named after its subject. Raises BadInput if there is no file, and BadFile for a file that cannot be read,
    lacks a bone, or differs from another file of the same subject.
    """
    paths = as_folders(folders)
    skeletons: dict[str, Skeleton] = {}
    for path in (file for folder in paths for file in scan_folder(folder, (".asf",)).files):
        subject, skeleton = path.stem.split("_", 1)[0], _read_skeleton(path)
        if not np.array_equal(skeletons.setdefault(subject, skeleton).bone_m, skeleton.bone_m):
            raise BadFile(path, f"another skeleton of subject {subject}", "the same as its copy", "Remove one of them.")
    if not skeletons:
        names = ", ".join(map(str, paths))
        raise BadInput(f"There is no ASF file below {names}.", "Name the folder of a motion library with skeletons.")
    return dict(sorted(skeletons.items()))


def _read_skeleton(path: Path) -> Skeleton:
    skeleton = read_asf(path)
    try:
        return skeleton.subset(BONES)[0]
    except UnknownName as error:
        raise BadFile(path, str(error), "the 24 bones of core.humanoid24", "Leave it out of the library.") from error
