"""Sources of a scenario's motion, the motion generator or a library of files, and skeletons of the people in it."""

import os
from functools import cache
from itertools import chain
from pathlib import Path

import numpy as np

from harness.core.humanoid24 import select_bones
from harness.core.motion import Clip
from harness.core.skeleton import Skeleton
from harness.errors import BadFile, BadInput, UnknownName
from harness.mocap import synthetic
from harness.mocap.index import scan_folder
from harness.mocap.library import LibraryFolders, MotionLibrary, as_folders
from harness.mocap.read.asf import read_asf
from harness.mocap.synthetic.takes import RIG_TAKES, generate_rig

MOCAP_VARIABLE = "HARNESS_MOCAP"
POPULATION_SIZE = 100
"""Number of synthetic skeletons besides the performers': modes and spreads are then known to a tenth [choice]."""


@cache
def _synthetic_names() -> tuple[str, ...]:
    """All takes; the behaviours alternate, so that the first names, which a message suggests, are of each."""
    takes = zip(*map(synthetic.take_names, synthetic.BEHAVIOURS), strict=True)
    return (*chain.from_iterable(takes), *RIG_TAKES)


@cache
def _unlisted_names() -> frozenset[str]:
    """Takes of the performers that no list names."""
    takes = (synthetic.take_names(behaviour, synthetic.UNLISTED_PERFORMERS) for behaviour in synthetic.BEHAVIOURS)
    return frozenset(chain.from_iterable(takes))


class SyntheticSource:
    """Takes of the motion generator; `seed` is the scenario's."""

    title = synthetic.SOURCE

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._clips: dict[str, Clip] = {}

    def names(self) -> tuple[str, ...]:
        return _synthetic_names()

    def check(self, name: str) -> None:
        """Raise UnknownName unless there is such a take, listed or not."""
        if name not in _synthetic_names() and name not in _unlisted_names():
            raise UnknownName("synthetic take", name, self.names())

    def subject(self, name: str) -> str:
        return _parse_take_name(name)[1]

    performer = subject

    def behaviour(self, name: str) -> str:
        return _parse_take_name(name)[0]

    def load(self, name: str) -> Clip:
        """The clip; the same object each time."""
        if name not in self._clips:
            is_rig = name in RIG_TAKES
            self._clips[name] = (
                generate_rig(name) if is_rig else synthetic.generate(*_parse_take_name(name), seed=self._seed)
            )
        return self._clips[name]

    def other_skeletons(self, without: str) -> dict[str, Skeleton]:
        """Skeletons drawn from the performers' distribution, the same for every seed; no performer is among them."""
        return _synthetic_population()


@cache
def _synthetic_population() -> dict[str, Skeleton]:
    return {
        f"other {number}": skeleton
        for number, skeleton in enumerate(synthetic.sample_skeletons(POPULATION_SIZE, seed=0), 1)
    }


def _parse_take_name(name: str) -> tuple[str, str, int]:
    """Behaviour, performer and number of a built-in take such as "table_tennis_p1_03"."""
    behaviour, performer, take = name.rsplit("_", 2)
    return behaviour, performer, int(take)


class LibrarySource:
    """Clips of a motion library."""

    title = "cmu"

    def __init__(self, library: MotionLibrary) -> None:
        self._library = library
        self._clips: dict[str, Clip] = {}
        self._skeletons: dict[str, Skeleton] | None = None

    def names(self) -> tuple[str, ...]:
        return self._library.names()

    def check(self, name: str) -> None:
        """Raise UnknownName unless there is such a clip."""
        self._library.entry(name)

    def subject(self, name: str) -> str:
        return self._library.entry(name).subject

    def performer(self, name: str) -> str:
        entry = self._library.entry(name)
        return entry.subject if entry.subject_known else ""

    def behaviour(self, name: str) -> str:
        return self._library.entry(name).behaviour

    def load(self, name: str) -> Clip:
        """The clip; the same object each time."""
        if name not in self._clips:
            self._clips[name] = self._library.load(name)
        return self._clips[name]

    def other_skeletons(self, without: str) -> dict[str, Skeleton]:
        """Skeletons of the library's ASF files; BadInput when there is none."""
        if self._skeletons is None:
            self._skeletons = read_skeletons(self._library.folders)
        return {subject: skeleton for subject, skeleton in self._skeletons.items() if subject != without}


MotionSource = SyntheticSource | LibrarySource
"""Clips by name. Either class says of a clip what an index, CMU's name or the motion generator tells; "" is unknown."""


def open_motion_source(kind: str, folders: LibraryFolders | None, *, seed: int, rate_hz: float | None) -> MotionSource:
    """The source `builtin` (the motion generator), or `cmu`: a library in one or several folders.

    Without `folders`, HARNESS_MOCAP names the library. `rate_hz` is the rate of AMC files whose rate no index names.
    Raises UnknownName for another kind, and BadInput when no folder is named or the library cannot be used.
    """
    if kind == "builtin":
        return SyntheticSource(seed)
    if kind != "cmu":
        raise UnknownName("motion source", kind, ("builtin", "cmu"))
    return LibrarySource(MotionLibrary(find_library_folders(folders), rate_hz=rate_hz))


def find_library_folders(folders: LibraryFolders | None) -> tuple[Path, ...]:
    """The folders of real motion that --mocap names, or else those that HARNESS_MOCAP names.

    Raises BadInput when neither names one, or when a named path is no folder.
    """
    folders = folders or folders_of_environment()
    if not folders:
        raise BadInput(
            "This needs real motion, and no library was named.",
            f"Give --mocap DIR or set {MOCAP_VARIABLE}; `harness mocap fetch cmu --subjects 13,14` downloads some; "
            "`harness demo` needs none.",
        )
    return as_folders(folders)


def folders_of_environment() -> tuple[Path, ...]:
    """The folders that HARNESS_MOCAP names, separated as in PATH (by `os.pathsep`); empty when it names none."""
    return tuple(Path(folder) for folder in os.environ.get(MOCAP_VARIABLE, "").split(os.pathsep) if folder)


def read_skeletons(folders: LibraryFolders) -> dict[str, Skeleton]:
    """Skeleton of each subject [m], sorted by subject, from the ASF files in one or several folders at any depth.

    A file is named after its subject. Raises BadInput if there is no file, and BadFile for a file that cannot be read,
    lacks a bone, or differs from another file of the same subject.
    """
    paths = as_folders(folders)
    skeletons: dict[str, Skeleton] = {}
    for path in (file for folder in paths for file in scan_folder(folder, (".asf",))[0]):
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
        return select_bones(skeleton)[0]
    except UnknownName as error:
        raise BadFile(path, str(error), "the 24 bones of core.humanoid24", "Leave it out of the library.") from error
