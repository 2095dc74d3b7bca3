"""The people of a library: one skeleton of 24 bones for every subject whose ASF file lies below the folder."""

from pathlib import Path

import numpy as np

from harness.core.humanoid24 import BONES
from harness.core.skeleton import Skeleton
from harness.errors import BadFile, BadInput, UnknownName
from harness.mocap.read.asf import read_asf


def read_skeletons(folder: Path | str) -> dict[str, Skeleton]:
    """Subject -> skeleton [m], sorted by subject; a file is called like its subject, and copies of it count once.

    BadInput when there is none; BadFile for one that cannot be read, lacks a bone, or differs from its copy.
    """
    top = Path(folder).resolve()
    found: dict[str, Skeleton] = {}
    for path in sorted(top.rglob("*")):
        if path.suffix.lower() != ".asf" or not path.is_file() or not path.resolve().is_relative_to(top):
            continue
        subject, read = path.stem.split("_", 1)[0], _read_skeleton(path)
        known = found.setdefault(subject, read)
        if not np.array_equal(known.bone_m, read.bone_m):
            raise BadFile(path, f"another skeleton of subject {subject}", "the same as its copy", "Remove one of them.")
    if not found:
        raise BadInput(f"There is no ASF file below {folder}.", "Name the folder of a motion library with skeletons.")
    return dict(sorted(found.items()))


def _read_skeleton(path: Path) -> Skeleton:
    whole = read_asf(path)
    try:
        return whole.subset(BONES)[0]
    except UnknownName as error:
        raise BadFile(path, str(error), "the 24 bones of docs/methods.md A2", "Leave it out of the library.") from error
