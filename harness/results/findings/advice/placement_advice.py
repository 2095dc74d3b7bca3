"""The advice of a placement study, as plain records: the search by halves, sizes compared, and a second method.

Sets of stations are tuples of names of candidates, in the order of the candidates (`PlacementFindings.candidates`).
"""

from dataclasses import dataclass
from typing import Literal

Effort = Literal["", "quick", "normal", "thorough"]
"""How many cells a question may use; "" for a study in a file, and for a number of clips that was asked for."""
Stations = tuple[str, ...]


@dataclass(frozen=True)
class HalvingRound:
    """One round of successive halving: sets of one size were compared, and the worse ones left out."""

    size: int
    """Number of stations of each set."""
    sets: int
    """Number of sets at the start."""
    units: int
    """Number of units on which they were compared, those of earlier rounds included."""
    kept: int
    """Number of sets that were kept."""
    base: Stations = ()
    """The stations that all of them contain, where one station after another is searched."""


@dataclass(frozen=True)
class SetError:
    """The error of a set on held-out units, with its 95 % interval."""

    stations: Stations
    error: float | None = None
    low: float | None = None
    high: float | None = None
    units: int = 0
    cost: float | None = None
    """Total cost of its stations; None without costs."""


@dataclass(frozen=True)
class PlacementAdvice:
    """The set that is recommended."""

    best: SetError
    why: Literal["only", "smallest", "between", "largest"]
    """`only`: one size was asked about. `smallest`, `between` and `largest` tell which of the asked sizes it has: the
    smallest one than which no larger one is better. With costs, larger means dearer."""
    ties: tuple[Stations, ...] = ()
    """Sets of the same size that were measured to the end and cannot be told from it."""
    of: int = 0
    """Number of sets of the same size."""


@dataclass(frozen=True)
class SizeStep:
    """The best set of one asked size against that of a larger one (with costs: a dearer one), on the held-out units."""

    smaller: Stations
    larger: Stations
    difference: float | None
    """Mean paired difference, positive if the larger set is better."""
    low: float | None = None
    """Ends of the 95 % interval of `difference`."""
    high: float | None = None
    p: float | None = None
    """Sign flips over units, corrected for all pairs of sizes (Holm); None where nothing can be told."""
    units: int = 0
    verdict: Literal["better", "worse", "cannot tell"] = "cannot tell"
    """Whether the larger set is better: p of at most 0.05, and an interval without zero."""


@dataclass(frozen=True)
class SecondChoice:
    """What the second method says of the best set of one size; with costs, of the advised one of its size."""

    chosen: Stations
    """The set that the first method chose."""
    best: Stations
    """The best set under the second method, among those that it measured."""
    difference: float | None
    """Error of `chosen` minus that of `best` under the second method, positive if `best` is better; 0 if they agree."""
    low: float | None = None
    """Ends of the 95 % interval of `difference`."""
    high: float | None = None
    worse: bool = False
    """Whether `chosen` is significantly worse: sign flips over units, corrected for all sets compared (Holm)."""
    of: int = 1
    """Number of sets that were compared."""
    units: int = 0
    shared: SetError | None = None
    """The set to wear where `chosen` is worse: tied with it under the first method, better than it under this one, and
    significantly worse than none. Its error is that of the first method on held-out units. None if there is none."""


@dataclass(frozen=True)
class SecondMethod:
    """The answer repeated with a second method: on the same clips, for the sets that the search did not leave out."""

    method: str
    choices: tuple[SecondChoice, ...]
    """One for each number of stations, the smallest first."""
    errors: tuple[SetError, ...] = ()
    """Errors of the sets under this method, on the clips on which they were compared."""
