"""Calibration of a tracker for one performer: the mount of each station, and the tracker's frame in the world."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from harness.core.arrays import Floats, freeze


@dataclass(frozen=True, eq=False)
class Calibration:
    """Mounts of S stations on their bones, and the pose of the tracker's frame in the world."""

    kind: str
    """Source of the values: `exact` (the truth of the simulation), `tpose`, `poses`, `liu2011` or `kim2012`."""
    stations: tuple[str, ...]
    """(S,) station names in the order of the stream's rows."""
    bones: tuple[str, ...]
    """(S,) the bone that carries each station."""
    mount_m: Floats
    """(S, 3) station origin in its bone's frame [m]."""
    bone_from_station: Floats
    """(S, 4) unit quaternion."""
    world_from_tracker: Floats
    """(4,) unit quaternion."""
    tracker_origin_m: Floats
    """(3,) origin of the tracker frame in the world [m]."""

    def __post_init__(self) -> None:
        stations = len(self.stations)
        freeze(self, mount_m=(stations, 3), bone_from_station=(stations, 4))
        freeze(self, world_from_tracker=(4,), tracker_origin_m=(3,))

    def of_stations(self, names: Sequence[str]) -> "Calibration":
        """The calibration of these stations, in this order; ValueError for one that it lacks."""
        rows = [self.stations.index(name) for name in names]
        return replace(
            self,
            stations=tuple(names),
            bones=tuple(self.bones[row] for row in rows),
            mount_m=self.mount_m[rows],
            bone_from_station=self.bone_from_station[rows],
        )
