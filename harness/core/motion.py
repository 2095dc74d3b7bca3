"""Recorded or generated motion: on its own skeleton (`Clip`), and on the body (`BodyMotion`)."""

from dataclasses import dataclass, field

from harness.core.arrays import Floats, freeze
from harness.core.skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class Clip:
    """Motion of T frames on the skeleton it was captured with; world axes x forward, y left, z up."""

    name: str
    """Subject and trial, such as "13_17"; a clip and its copies in other formats share it."""
    subject: str
    source: str
    """Where it comes from: "cmu", "built-in performer", a folder's name."""
    behaviour: str
    """walking, boxing, jumping, golf, table_tennis, ... or "" when unknown."""
    skeleton: Skeleton
    rate_hz: float
    root_m: Floats
    """(T, 3) root position [m]."""
    world_from_root: Floats
    """(T, 4) unit quaternion (w, x, y, z)."""
    angles_rad: Floats
    """(T, D) hinge angles in the skeleton's order [rad]."""
    notes: tuple[str, ...] = field(default=())
    """What a user of the clip should know (glitches, inferred facts)."""

    def __post_init__(self) -> None:
        freeze(self, root_m=("T", 3), world_from_root=("T", 4))
        freeze(self, angles_rad=(len(self.root_m), len(self.skeleton.axes)))

    def __len__(self) -> int:
        return len(self.root_m)

    @property
    def duration_s(self) -> float:
        return (len(self) - 1) / self.rate_hz


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Motion on the body: T MuJoCo configurations at an even rate. What methods learn from."""

    name: str
    subject: str
    source: str
    behaviour: str
    rate_hz: float
    qpos: Floats
    """(T, 55) root position [m], root quaternion (w, x, y, z), 48 hinge angles [rad]."""

    def __post_init__(self) -> None:
        freeze(self, qpos=("T", "Q"))

    def __len__(self) -> int:
        return len(self.qpos)
