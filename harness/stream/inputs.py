"""Which readings a method is given: the input combinations of Liu et al. 2011 (docs/papers.md A6)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.core.arrays import Bools, freeze
from harness.errors import BadInput, UnknownName
from harness.stream.frame import TrackerFrame

INPUT_COMBINATIONS = {
    "pos+ori": "position and orientation of every station",
    "pos+torso_ori": "position of every station, orientation of the torso",
    "pos": "position of every station",
    "ori": "orientation of every station",
    "mixed": "position of torso and both ankles, orientation of torso, head and both hands (or wrists)",
}
"""Description of each input combination, by the name used in tables."""
_REQUIRED = {
    "pos+ori": ("all", "all"),
    "pos+torso_ori": ("all", "torso"),
    "pos": ("all", ""),
    "ori": ("", "all"),
    "mixed": ("torso left_ankle right_ankle", "torso head hands"),
}
"""Stations whose position and whose orientation each combination uses."""


@dataclass(frozen=True, slots=True, eq=False)
class Inputs:
    """Whether the position and the orientation of each of S stations are used."""

    name: str
    position: Bools
    """(S,) True where the position is used."""
    orientation: Bools
    """(S,) True where the orientation is used."""

    def __post_init__(self) -> None:
        freeze(self, bool, position=("S",), orientation=("S",))

    def mask(self, frame: TrackerFrame) -> TrackerFrame:
        """Return the frame with all other readings marked invalid and set to NaN."""
        if self.position.all() and self.orientation.all():
            return frame
        return replace(
            frame,
            position_m=np.where(self.position[:, None], frame.position_m, np.nan),
            tracker_from_station=np.where(self.orientation[:, None], frame.tracker_from_station, np.nan),
            position_valid=frame.position_valid & self.position,
            orientation_valid=frame.orientation_valid & self.orientation,
        )


def make_inputs(name: str, stations: Sequence[str]) -> Inputs:
    """Build the named combination for these stations. Raises BadInput when it needs a station that is not worn, and
    UnknownName for an unknown combination.
    """
    if name not in _REQUIRED:
        raise UnknownName("input combination", name, INPUT_COMBINATIONS)
    hands = ("left_wrist", "right_wrist") if "left_wrist" in stations else ("left_hand", "right_hand")
    masks = []
    for required in _REQUIRED[name]:
        names = stations if required == "all" else required.replace("hands", " ".join(hands)).split()
        if missing := [station for station in names if station not in stations]:
            raise BadInput(
                f"inputs {name!r} need a station called {' and one called '.join(missing)}.",
                f"Stations worn: {', '.join(stations)}.",
            )
        masks.append(np.array([station in names for station in stations]))
    return Inputs(name, *masks)
