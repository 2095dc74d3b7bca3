"""The constellation: the fixed emitters of the room."""

from dataclasses import dataclass
from typing import Annotated

from harness.core.names import Text
from harness.core.ranges import Range, check_fields


@dataclass(frozen=True)
class ConstellationSettings:
    """The emitters of a scenario."""

    name: Text = "hall"
    """A shipped constellation: `hall` for performers who walk, `cave` for performers on the spot."""
    file: Text = ""
    """Path of a file of `MCF` lines, relative to the scenario's; it replaces `name`."""
    centre_m: Annotated[tuple[float, float] | None, Range(-100.0, 100.0)] = None
    """World x and y of the constellation's origin [m]; by default above the middle of the take's path."""
    cone_deg: Annotated[float, Range(1.0, 90.0)] = 70.0
    """Largest angle between an emitter's normal and its sound [deg] (docs/is900.md 13.1; that the published 70 deg are
    measured from the normal is a choice)."""
    range_m: Annotated[float, Range(0.1, 4.2)] = 4.0
    """Largest distance from emitter to station [m]: 4 m with power boosters, 3 m without (docs/is900.md 13.1)."""
    survey_sd_m: Annotated[float, Range(0.0, 1.0)] = 0.001
    """Standard deviation of the error of an emitter's surveyed position along each axis [m] [choice]."""

    def __post_init__(self) -> None:
        check_fields(self)
