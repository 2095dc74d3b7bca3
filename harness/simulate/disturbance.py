"""Faults that a reconstructor must get over, by name: what happens, for how long, and back to normal.

Two runs that differ in nothing but their disturbance share every other draw (`core.seeds`), so that the one shows what
the other's error would have been; `results.recovery` compares them.
"""

from dataclasses import asdict, dataclass, replace
from typing import Any, Literal, get_args

import numpy as np

from harness.errors import UnknownName
from harness.simulate.components.lost_station import LostStation
from harness.simulate.components.orientation_offset import OrientationOffset
from harness.simulate.components.position_offset import PositionOffset
from harness.simulate.noise import Noise
from harness.simulate.parameter_ranges import require_ranges

Kind = Literal["none", "one_lost", "all_lost", "one_off", "all_turned", "start_off"]
KINDS: tuple[Kind, ...] = get_args(Kind)


@dataclass(frozen=True)
class Disturbance:
    """One named fault that ends; sizes and length are those of docs/methods.md H ("recovery")."""

    kind: Kind = "none"
    """One station or all lost, one off its place, all orientations turned, or everything elsewhere at the start."""
    station: str = ""
    """The one; "" is the first."""
    from_s: float = 3.0
    """When it begins [s]; `start_off` begins with the take."""
    lasts_s: float = 2.0
    off_m: float = 0.3
    """How far the one station is off [m]."""
    turn_deg: float = 30.0
    """About the vertical [deg]."""
    start_off_m: float = 1.0
    """How far from its place everything is at the start [m]."""

    def __post_init__(self) -> None:
        require_ranges(self, from_s=(0.0, 1e6), lasts_s=(0.0, 1e6))

    @property
    def begins_s(self) -> float:
        return 0.0 if self.kind == "start_off" else self.from_s

    @property
    def ends_s(self) -> float:
        """The first moment after it [s]."""
        return self.begins_s + self.lasts_s

    def as_dict(self) -> dict[str, Any]:
        """With the time of its beginning and end, so that a reader need not know how they are found."""
        return {**asdict(self), "begins_s": self.begins_s, "ends_s": self.ends_s}

    def add_to(self, noise: Noise, stations: tuple[str, ...]) -> Noise:
        """The noise and this on top of it; UnknownName when nobody wears the one station."""
        if self.station and self.station not in stations:
            raise UnknownName("station", self.station, stations)
        within = {"from_s": self.begins_s, "to_s": self.ends_s}
        one = (self.station or stations[0],)
        match self.kind:
            case "none":
                return noise
            case "one_lost" | "all_lost":
                gone = one if self.kind == "one_lost" else stations
                return replace(noise, lost=(*noise.lost, *(LostStation(s, fade_s=0.0, **within) for s in gone)))
            case "one_off":
                return replace(
                    noise,
                    position_offset=(
                        *noise.position_offset,
                        PositionOffset(one, offset_m=forward_offset_m(self.off_m), **within),
                    ),
                )
            case "start_off":
                everything = PositionOffset((), offset_m=forward_offset_m(self.start_off_m), **within)
                return replace(noise, position_offset=(*noise.position_offset, everything))
            case "all_turned":
                turned = OrientationOffset((), angle_rad=float(np.deg2rad(self.turn_deg)), **within)
                return replace(noise, orientation_offset=(*noise.orientation_offset, turned))


def forward_offset_m(by_m: float) -> tuple[float, float, float]:
    """Forward in the tracker's frame."""
    return by_m, 0.0, 0.0
