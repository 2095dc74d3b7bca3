"""What a page of coverage shows, as plain arrays and numbers."""

from collections.abc import Sequence
from dataclasses import dataclass

from harness.core.arrays import Floats, Ints
from harness.core.number_format import format_fixed

NO_FIX = "no fix"
"""Stands for a dilution of precision where ranges fix no position."""


@dataclass(frozen=True, eq=False)
class PlanView:
    """Coverage at one height, at X x Y places in the tracker's frame."""

    height_m: float
    """Height above the floor [m]."""
    x_m: Floats
    """(X,) forward [m]."""
    y_m: Floats
    """(Y,) to the right [m]."""
    heard: Ints
    """(X, Y) number of emitters heard."""
    dilution: Floats
    """(X, Y) dilution of precision; NaN without a fix."""


@dataclass(frozen=True)
class CoverageRow:
    """Coverage of a cube on the floor, or of one height of it."""

    place: str
    share: float
    """Share of the places where three or more emitters are heard."""
    fixed: float
    """Share of the places with a dilution of precision up to 10."""
    heard: float
    """Median number of emitters heard."""
    dilution: float
    """Median dilution of precision; NaN without a fix."""


@dataclass(frozen=True)
class StationRow:
    """Coverage of a station of a performer."""

    station: str
    shares: tuple[float, float, float, float]
    """Shares of the time in which it hears no emitter, one, two, and three or more."""
    fixed: float
    """Share of the time with a dilution of precision up to 10."""
    dilution: float
    """Median dilution of precision; NaN without a fix."""


@dataclass(frozen=True, eq=False)
class CoverageContent:
    """Everything on the page of one constellation."""

    name: str
    emitters: str
    """Number and extent of the emitters, in words."""
    reach: str
    """Their range and cone, in words."""
    turn: str
    """How long a turn of the emitters that fire takes, in words."""
    emitter_m: Floats
    """(J, 3) positions in the tracker's frame [m]."""
    half_m: float
    """Half the side of the cube below the middle [m]."""
    views: Sequence[PlanView]
    rows: Sequence[CoverageRow]
    """The cube first."""
    clip: str = ""
    """Name of the clip of `stations`; "" without any."""
    stations: Sequence[StationRow] = ()
    command: str = ""
    """The command line that wrote the page."""


def format_dilution(dilution: float) -> str:
    """A dilution of precision, or "no fix"."""
    return format_fixed(dilution, 2) if dilution == dilution else NO_FIX
