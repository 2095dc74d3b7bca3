"""Where a scenario's motion comes from: the built-in performer, or a library of files that the user names."""

import os
from pathlib import Path
from typing import Protocol

from harness.core.motion import Clip
from harness.errors import BadInput, UnknownName

VARIABLE = "HARNESS_MOCAP"


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
    def load(self, name: str) -> Clip: ...


def open_source(kind: str, folder: Path | None, *, seed: int, rate_hz: float | None) -> MotionSource:
    """`builtin`, or `cmu` from `folder` or else from HARNESS_MOCAP; BadInput when neither names one."""
    if kind == "builtin":
        return BuiltIn(seed)
    if kind != "cmu":
        raise UnknownName("motion source", kind, ("builtin", "cmu"))
    from harness.mocap.library import MotionLibrary

    return Files(MotionLibrary(library_folder(folder), rate_hz=rate_hz))


def library_folder(folder: Path | None) -> Path:
    """The folder of real motion that --mocap or HARNESS_MOCAP names; BadInput when there is none."""
    named = folder or (Path(os.environ[VARIABLE]) if os.environ.get(VARIABLE) else None)
    if named is None:
        raise BadInput(
            "This needs real motion, and no library was named.",
            f"Give --mocap DIR or set {VARIABLE}; `harness mocap fetch cmu --subjects 13,14` downloads some; "
            "`harness demo` needs none.",
        )
    if not named.is_dir():
        raise BadInput(f"{named} is no folder.", f"--mocap or {VARIABLE} names the folder of the motion library.")
    return named
