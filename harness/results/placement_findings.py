"""What a placement study came to: which trackers to wear and where, as plain records that are stored as JSON.

A *set* is a choice of candidates, worn together. Errors are of one metric, one figure for each clip (averaged over
methods, seeds and what else the study varies), so that everything is compared on the same clips. A page can be drawn
from the file alone.
"""

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from harness.core.fields import build
from harness.core.files import read_json, to_json_types, write_json
from harness.errors import BadFile, UnknownName
from harness.results.findings import Claim

SCHEMA = 1
PlacementMode = Literal["ablate", "add", "greedy", "exhaustive", "refine"]
MODES: dict[PlacementMode, str] = {
    "ablate": "each left out of a base set",
    "add": "each added to a base set",
    "greedy": "one after another, the best next one each time",
    "exhaustive": "every set of so many",
    "refine": "places moved along and around the bone",
}
"""What each mode tries."""
StationNames = tuple[str, ...]
"""Names of candidates, in the order of `PlacementFindings.candidates`: equal sets are equal tuples."""


@dataclass(frozen=True)
class StationPlacement:
    """A candidate: one tracker at one place (see `harness.body.mounts.Mount`); a moved one has its own name."""

    name: str
    bone: str
    along: float
    around_deg: float
    stand_off_m: float = 0.01
    side: Literal["", "left", "right"] = ""
    moved_from: str = ""
    """The candidate that `refine` moved here."""


@dataclass(frozen=True)
class StationSetResult:
    """One set under the study's own conditions."""

    stations: StationNames
    rate_hz: float
    """At which the line carries so many."""
    errors: dict[str, float | None]
    """Clip -> error; None where it was not measured."""
    mean: float | None
    """Over the clips that were measured."""
    low: float | None = None
    """Ends of the 95 % interval of the mean over clips; None with too few."""
    high: float | None = None


@dataclass(frozen=True)
class RankedSet:
    """One set among others of its ranking."""

    stations: StationNames
    rank: int
    """By mean error, 1 the best."""
    rank_low: int
    """The best rank that the paired intervals leave it: 1 and how many are surely better."""
    rank_high: int
    """The worst: how many there are, less those that are surely worse."""
    difference: float | None
    """Mean paired difference to the set of rank 1 over clips, positive where that one is better; 0 of itself."""
    low: float | None = None
    """Ends of its 95 % interval."""
    high: float | None = None
    tied: bool = False
    """Nothing shows that it is worse than rank 1; also true of rank 1 itself."""
    step: float | None = None
    """Mean paired difference to the set of the rank before; 0 of rank 1."""
    step_low: float | None = None
    step_high: float | None = None


@dataclass(frozen=True)
class Ranking:
    """Sets that compete for one job, best first."""

    mode: PlacementMode
    title: str
    """Such as "3 trackers of 12"."""
    rows: tuple[RankedSet, ...]
    base: StationNames = ()
    """What `ablate` takes from and `add` adds to."""


@dataclass(frozen=True)
class MarginalContribution:
    """What one candidate is worth beside others: the error without it less the error with it."""

    candidate: str
    mode: Literal["ablate", "add", "exhaustive"]
    """Left out of `base`, added to it, or, over every set tried, on average with it against without it."""
    base: StationNames
    difference: float | None
    """Positive where wearing it helps, in the metric's unit."""
    low: float | None = None
    high: float | None = None
    clips: int = 0


@dataclass(frozen=True)
class SearchStep:
    """One step of a search: the set that it came to, against the one before."""

    stations: StationNames
    changed: str
    """Such as "+ left_ankle", or "left_ankle: along 0.90 to 0.80"; "" of where it began."""
    difference: float | None = None
    """Error before less error now: positive where the step helps."""
    low: float | None = None
    high: float | None = None
    tied: tuple[str, ...] = ()
    """What else could have been chosen: nothing shows that it is worse."""


@dataclass(frozen=True)
class PlacementSearch:
    """A search that goes step by step."""

    mode: Literal["greedy", "refine"]
    title: str
    steps: tuple[SearchStep, ...]
    ended: str = ""
    """Why it ended."""
    held_out: float | None = None
    """What the last set saves against the first on clips on which nothing was chosen; None where it was not judged."""
    held_out_low: float | None = None
    held_out_high: float | None = None
    held_out_clips: int = 0


@dataclass(frozen=True)
class BestSet:
    """The set of so many stations with the least error."""

    stations: StationNames
    ties: tuple[StationNames, ...] = ()
    """Others of as many that nothing shows to be worse."""
    on_front: bool = True
    """No set of fewer or as many stations errs less (Pareto)."""
    of: int = 0
    """How many sets of so many stations it was chosen from."""
    stays: float | None = None
    """Share of resamples of the clips in which it is still the best of them."""
    crossed: float | None = None
    """Mean error on each clip of whichever set the other clips would have chosen: what choosing and judging on the same
    clips flatters the best by is this less its mean."""
    held_out: float | None = None
    """Its mean error on the clips on which nothing was chosen."""
    held_out_low: float | None = None
    held_out_high: float | None = None
    held_out_clips: int = 0


@dataclass(frozen=True)
class PlacementCondition:
    """The same sets elsewhere: another behaviour, method or noise."""

    name: str
    """Such as "boxing" or "ik"; the first of a study is its own."""
    kind: str
    """Such as "behaviour", "method" or "noise"."""
    best: dict[str, StationNames]
    """How many stations -> the best set there; JSON's keys are texts."""
    means: tuple[float | None, ...]
    """Of each set of `PlacementFindings.compared`."""
    clips: int = 0
    stays: float | None = None
    """Share of resamples of the clips in which the best of the compared sets is still the best."""


@dataclass(frozen=True)
class RankAgreement:
    """How alike two conditions rank the sets that both measured."""

    a: str
    b: str
    tau: float | None
    """Kendall's tau-b over the sets, 1 the same order, 0 none, -1 reversed."""
    sets: int
    low: float | None = None
    """Ends of its 95 % interval, by resampling clips; None where it was not taken."""
    high: float | None = None


@dataclass(frozen=True)
class PlacementFindings:
    """A placement study; findings.json in its folder."""

    name: str
    title: str
    """What was asked, in one line."""
    metric: str
    unit: str
    motion: str
    """Such as "built-in performer"."""
    behaviours: tuple[str, ...]
    methods: tuple[str, ...]
    noise: str
    link: str
    """How many stations the line carries at which rate, in words; "" where the rate is the same for all."""
    seed: int
    command: str
    candidates: tuple[StationPlacement, ...]
    tried: tuple[StationSetResult, ...]
    best: tuple[BestSet, ...]
    """By number of stations, fewest first."""
    circumstances: dict[str, Any]
    """See `manifest.here`."""
    rankings: tuple[Ranking, ...] = ()
    searches: tuple[PlacementSearch, ...] = ()
    worth: tuple[MarginalContribution, ...] = ()
    compared: tuple[StationNames, ...] = ()
    """The sets that every condition ranks."""
    conditions: tuple[PlacementCondition, ...] = ()
    agreements: tuple[RankAgreement, ...] = ()
    """Of each pair of conditions."""
    claims: tuple[Claim, ...] = ()
    """What papers say, and what came out."""
    notes: tuple[str, ...] = ()
    """What a reader must know: negative results, what was left out and why."""
    failures: dict[str, str] = field(default_factory=dict)
    """Cell -> why it has no result."""
    planned: int = 0
    """Cells."""
    better: Literal["lower", "higher"] = "lower"
    """Which values of the metric are good; differences above are signed so that positive is as they say."""
    kind: Literal["placement"] = "placement"
    schema: int = SCHEMA

    def of(self, stations: StationNames) -> StationSetResult | None:
        """What came of a set."""
        return next((tried for tried in self.tried if tried.stations == stations), None)


def write_placement(path: Path, findings: PlacementFindings) -> None:
    write_json(path, to_json_types(dataclasses.asdict(findings)))


def read_placement(path: Path) -> PlacementFindings:
    """BadFile when it is none, of another version, or names sets and candidates that it does not have."""
    expected, advice = "the findings of a placement study", "Give the command of the study again."
    content = read_json(path, expected)
    if content.get("schema") != SCHEMA:
        raise BadFile(path, f"schema {content.get('schema')}", f"schema {SCHEMA}", advice)
    try:
        findings = build(PlacementFindings, content, "findings")
    except (TypeError, UnknownName) as error:
        raise BadFile(path, str(error), expected, advice) from error
    if strangers := _unknown_stations(findings):
        raise BadFile(path, f"names {strangers[0]!r}, which is no candidate of it", expected, advice)
    return findings


def is_placement_findings(path: Path) -> bool:
    """Whether this file says that it holds a placement study's findings; BadFile when it is no JSON."""
    return read_json(path, "findings").get("kind") == "placement"


def _unknown_stations(findings: PlacementFindings) -> list[str]:
    """Names of stations that are no candidates."""
    known = {place.name for place in findings.candidates}
    sets = [tried.stations for tried in findings.tried]
    sets += [row.stations for ranking in findings.rankings for row in ranking.rows]
    sets += [step.stations for search in findings.searches for step in search.steps]
    sets += [stations for best in findings.best for stations in (best.stations, *best.ties)]
    sets += [*findings.compared, *((worth.candidate,) for worth in findings.worth)]
    return sorted({name for stations in sets for name in stations} - known)
