"""Disturbances: named faults of limited duration from which a reconstructor must recover.

Two runs that differ only in their disturbance share every other random draw (`core.seeds`). So the undisturbed run
shows the error without the fault; `compare.run_summary.recovery` compares the two.
"""

from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any, Literal, get_args

import numpy as np

from harness.core.ranges import CheckedFields, Range
from harness.errors import UnknownName
from harness.simulate.components.faults import LostStation, OrientationOffset, PositionOffset
from harness.simulate.noise import Noise

Kind = Literal["none", "one_lost", "all_lost", "one_off", "all_turned", "start_off"]
KINDS: tuple[Kind, ...] = get_args(Kind)


@dataclass(frozen=True)
class Disturbance(CheckedFields):
    """A fault of limited duration; sizes and lengths are those of docs/metrics.md ("recovery")."""

    kind: Kind = "none"
    """Kind of fault; docs/metrics.md describes each."""
    station: str = ""
    """Station of `one_lost` and `one_off`; "" is the first."""
    from_s: Annotated[float, Range(0.0, 1e6)] = 3.0
    """Beginning [s]; `start_off` always begins with the take."""
    lasts_s: Annotated[float, Range(0.0, 1e6)] = 2.0
    """Duration [s]."""
    off_m: Annotated[float, Range(-100.0, 100.0)] = 0.3
    """Position error of `one_off` [m]."""
    turn_deg: Annotated[float, Range(-360.0, 360.0)] = 30.0
    """Angle of `all_turned` about the vertical [deg]."""
    start_off_m: Annotated[float, Range(-100.0, 100.0)] = 1.0
    """Position error of `start_off` [m]."""

    @property
    def begins_s(self) -> float:
        """First time of the fault [s]."""
        return 0.0 if self.kind == "start_off" else self.from_s

    @property
    def ends_s(self) -> float:
        """First time after the fault [s]."""
        return self.begins_s + self.lasts_s

    def as_dict(self) -> dict[str, Any]:
        """Fields as a dictionary, with the computed beginning and end."""
        return {**asdict(self), "begins_s": self.begins_s, "ends_s": self.ends_s}

    def add_to(self, noise: Noise, stations: tuple[str, ...]) -> Noise:
        """The noise with this fault added; UnknownName for a station that is not worn."""
        if self.station and self.station not in stations:
            raise UnknownName("station", self.station, stations)
        within = {"from_s": self.begins_s, "to_s": self.ends_s}
        one = (self.station or stations[0],)
        match self.kind:
            case "none":
                return noise
            case "one_lost" | "all_lost":
                lost = one if self.kind == "one_lost" else stations
                return replace(noise, lost=(*noise.lost, *(LostStation(s, fade_s=0.0, **within) for s in lost)))
            case "one_off" | "start_off":
                which, off_m = (one, self.off_m) if self.kind == "one_off" else ((), self.start_off_m)
                off = PositionOffset(which, offset_m=forward_offset_m(off_m), **within)
                return replace(noise, position_offset=(*noise.position_offset, off))
            case "all_turned":
                turned = OrientationOffset((), angle_rad=float(np.deg2rad(self.turn_deg)), **within)
                return replace(noise, orientation_offset=(*noise.orientation_offset, turned))


def forward_offset_m(by_m: float) -> tuple[float, float, float]:
    """An offset forward in the tracker's frame [m]."""
    return by_m, 0.0, 0.0
