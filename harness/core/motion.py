"""Motion as recorded or generated, on the actor's skeleton (`Clip`), and on the MuJoCo body (`BodyMotion`)."""

from dataclasses import dataclass, field

from harness.core.arrays import Floats, freeze
from harness.core.skeleton import Skeleton
from harness.core.time_grid import require_rate


@dataclass(frozen=True, eq=False)
class Clip:
    """T frames of motion on the skeleton of its recording; world axes x forward, y left, z up."""

    name: str
    """Subject and trial, such as "13_17"; copies of a clip in other formats have the same name."""
    subject: str
    source: str
    """Origin, such as "cmu", "built-in performer" or the name of a folder."""
    behaviour: str
    """What the performer does, such as walking or table_tennis; "" if unknown."""
    skeleton: Skeleton
    rate_hz: float
    root_m: Floats
    """(T, 3) root position [m]."""
    world_from_root: Floats
    """(T, 4) unit quaternion (w, x, y, z)."""
    angles_rad: Floats
    """(T, D) hinge angles in the order of the skeleton [rad]."""
    notes: tuple[str, ...] = field(default=())
    """Remarks for users of the clip, such as glitches and inferred facts."""

    def __post_init__(self) -> None:
        freeze(self, root_m=("T", 3), world_from_root=("T", 4))
        freeze(self, angles_rad=(len(self.root_m), len(self.skeleton.axes)))
        require_rate(self.rate_hz, len(self), self.name)

    def __len__(self) -> int:
        return len(self.root_m)

    @property
    def duration_s(self) -> float:
        return (len(self) - 1) / self.rate_hz


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """T MuJoCo configurations of the body at an even rate. Methods learn from such motions."""

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

    @property
    def duration_s(self) -> float:
        """Time from the first frame to the last one [s]."""
        return (len(self) - 1) / self.rate_hz
