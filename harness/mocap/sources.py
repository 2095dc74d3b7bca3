"""Where a scenario's motion comes from: the built-in performer, or a library of files that the user names."""

import os
from functools import cache
from pathlib import Path
from typing import Protocol

from harness.core.motion import Clip
from harness.core.skeleton import Skeleton
from harness.errors import BadInput, UnknownName
from harness.mocap import synthetic
from harness.mocap.library import MotionLibrary
from harness.mocap.skeletons import read_skeletons

MOCAP_VARIABLE = "HARNESS_MOCAP"
POPULATION_SIZE = 100
"""So many others there are beside the built-in performers: modes and spreads are then known to a tenth [choice]."""


class MotionSource(Protocol):
    """Clips by name."""

    @property
    def title(self) -> str:
        """As it stands in tables and on the page."""
        ...

    def names(self) -> tuple[str, ...]: ...
    def check(self, name: str) -> None:
        """UnknownName unless there is such a clip."""
        ...

    def subject(self, name: str) -> str: ...
    def behaviour(self, name: str) -> str:
        """What the clip shows, "" where nobody knows."""
        ...

    def load(self, name: str) -> Clip:
        """The same object each time."""
        ...

    def other_skeletons(self, without: str) -> dict[str, Skeleton]:
        """Skeletons by subject, to learn from what people's bones are like: of all whom the source knows but one."""
        ...


def open_motion_source(kind: str, folder: Path | None, *, seed: int, rate_hz: float | None) -> MotionSource:
    """`builtin`, or `cmu` from `folder` or else from HARNESS_MOCAP; BadInput when neither names one."""
    if kind == "builtin":
        return SyntheticSource(seed)
    if kind != "cmu":
        raise UnknownName("motion source", kind, ("builtin", "cmu"))
    return LibrarySource(MotionLibrary(find_library_folder(folder), rate_hz=rate_hz))


class SyntheticSource:
    """The built-in performer's takes; the seed is the scenario's."""

    title = synthetic.SOURCE

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._made: dict[str, Clip] = {}

    def names(self) -> tuple[str, ...]:
        return tuple(name for behaviour in synthetic.BEHAVIOURS for name in synthetic.take_names(behaviour))

    def check(self, name: str) -> None:
        if name not in self.names():
            raise UnknownName("built-in take", name, self.names())

    def subject(self, name: str) -> str:
        return _parse_take_name(name)[1]

    def behaviour(self, name: str) -> str:
        return _parse_take_name(name)[0]

    def load(self, name: str) -> Clip:
        if name not in self._made:
            behaviour, who, take = _parse_take_name(name)
            self._made[name] = synthetic.generate(behaviour, who, take, seed=self._seed)
        return self._made[name]

    def other_skeletons(self, without: str) -> dict[str, Skeleton]:
        """Drawn from the performers' spread, whatever the seed; no performer is among them."""
        return _synthetic_population()


@cache
def _synthetic_population() -> dict[str, Skeleton]:
    return {
        f"other {number}": skeleton
        for number, skeleton in enumerate(synthetic.sample_skeletons(POPULATION_SIZE, seed=0), 1)
    }


def _parse_take_name(name: str) -> tuple[str, str, int]:
    """Behaviour, performer and number of a built-in take such as "table_tennis_p1_03"."""
    behaviour, who, take = name.rsplit("_", 2)
    return behaviour, who, int(take)


class LibrarySource:
    """Clips of a library."""

    title = "cmu"

    def __init__(self, library: MotionLibrary) -> None:
        self._library = library
        self._read: dict[str, Clip] = {}
        self._people: dict[str, Skeleton] | None = None

    def names(self) -> tuple[str, ...]:
        return self._library.names()

    def check(self, name: str) -> None:
        self._library.entry(name)

    def subject(self, name: str) -> str:
        return self._library.entry(name).subject

    def behaviour(self, name: str) -> str:
        return self._library.entry(name).behaviour

    def load(self, name: str) -> Clip:
        if name not in self._read:
            self._read[name] = self._library.load(name)
        return self._read[name]

    def other_skeletons(self, without: str) -> dict[str, Skeleton]:
        """The library's ASF skeletons; BadInput when there is none."""
        if self._people is None:
            self._people = read_skeletons(self._library.folder)
        return {subject: skeleton for subject, skeleton in self._people.items() if subject != without}


def find_library_folder(folder: Path | None) -> Path:
    """The folder of real motion that --mocap or HARNESS_MOCAP names; BadInput when there is none."""
    named = folder or (Path(os.environ[MOCAP_VARIABLE]) if os.environ.get(MOCAP_VARIABLE) else None)
    if named is None:
        raise BadInput(
            "This needs real motion, and no library was named.",
            f"Give --mocap DIR or set {MOCAP_VARIABLE}; `harness mocap fetch cmu --subjects 13,14` downloads some; "
            "`harness demo` needs none.",
        )
    if not named.is_dir():
        raise BadInput(f"{named} is no folder.", f"--mocap or {MOCAP_VARIABLE} names the folder of the motion library.")
    return named
