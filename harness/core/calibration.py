"""What is known about trackers before a session starts: where each sits on the body, and the room's frame."""

from dataclasses import dataclass

from harness.core.arrays import Floats, freeze


@dataclass(frozen=True, eq=False)
class Calibration:
    """S stations on their bones, and the tracker's frame in the world."""

    kind: str
    """`exact` (the truth of the simulation), `tpose` or `poses`."""
    stations: tuple[str, ...]
    """Names, in the order of the stream's rows."""
    bones: tuple[str, ...]
    """(S,) the bone that carries each."""
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
