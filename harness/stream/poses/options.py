"""What a caller knows about a file of poses, in place of what its content shows."""

import math
from dataclasses import dataclass
from itertools import permutations

from harness.core.units import ANGLE_UNITS_RAD, TIME_UNITS_S
from harness.errors import BadInput

QUATERNION_ORDERS = ("xyzw", "wxyz")
EULER_ORDERS = tuple(map("".join, permutations("xyz")))
UP_AXES = ("x", "y", "z", "-x", "-y", "-z")


@dataclass(frozen=True)
class PoseFileOptions:
    """Each field is None where the file shall tell. Raises BadInput for values that are not possible."""

    columns: tuple[str, ...] | None = None
    """Names of the columns in place of a header, such as ("time", "x", "y", "z", "qx", "qy", "qz", "qw")."""
    unit_m: float | None = None
    """Length of 1 in the file [m]."""
    quaternion: str | None = None
    """Order of a quaternion's components: "xyzw" or "wxyz"."""
    up: str | None = None
    """Axis of the file's world that points up: one of `UP_AXES`."""
    time_unit: str | None = None
    """Unit of the times: "s", "ms", "us" or "ns"."""
    rate_hz: float | None = None
    """Samples per second of a file without times."""
    untimed: bool = False
    """Whether a file without times and without a rate is read all the same, with numbers of samples as its times."""
    euler: str | None = None
    """Axes about which angles turn, each time as the body then stands: one of `EULER_ORDERS`, such as "zyx" for yaw,
    pitch, roll; with ":deg" or ":rad" behind it also their unit."""

    def __post_init__(self) -> None:
        for flag, value, known in (
            ("--quaternion", self.quaternion, QUATERNION_ORDERS),
            ("--up", self.up, UP_AXES),
            ("--time-unit", self.time_unit, tuple(TIME_UNITS_S)),
            ("--euler", self.euler and self.euler.partition(":")[0], EULER_ORDERS),
            ("Unit of --euler", self.angle_unit or None, tuple(ANGLE_UNITS_RAD)),
        ):
            if value is not None and value not in known:
                raise BadInput(f"{flag} {value!r}.", f"Choose one of {', '.join(known)}.")
        for flag, number in (("--rate", self.rate_hz), ("--unit", self.unit_m)):
            if number is not None and not 0.0 < number < math.inf:
                raise BadInput(f"{flag} {number:g}.", "Give a positive number.")

    @property
    def angle_unit(self) -> str:
        """The unit of angles that `euler` names; "" without one."""
        return (self.euler or "").partition(":")[2]
