"""Findings of a placement study (which trackers to wear, and where), as plain records that are stored as JSON.

A *set* is a choice of candidates that are worn together. All errors are of one metric, with one value per unit
of statistics (averaged over clips, methods and seeds), so that sets are compared on the same units. A page
can be drawn from the file alone.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from harness.errors import BadFile
from harness.results.files.digests import check_study, read_record, write_record
from harness.results.findings.advice import Effort, HalvingRound, PlacementAdvice, SecondMethod, SetError, SizeStep
from harness.results.findings.benchmark_statement import BenchmarkStatement

SCHEMA = 1
_RENAMED_KEYS = {"stays": "selection_stability", "crossed": "cross_validated_error", "worth": "contributions"}
"""Key in findings of earlier versions -> today's."""
PlacementMode = Literal["ablate", "add", "greedy", "exhaustive", "refine", "halve"]
MODES: dict[PlacementMode, str] = {
    "ablate": "each left out of a base set",
    "add": "each added to a base set",
    "greedy": "one after another, the best next one each time",
    "exhaustive": "every set of so many",
    "refine": "places moved along and around the bone",
    "halve": "the worse half left out again and again, the others measured on twice as many units",
}
"""Mode -> the sets that it tries."""
StationNames = tuple[str, ...]
"""Names of candidates in the order of `PlacementFindings.candidates`, so that equal sets are equal tuples."""


@dataclass(frozen=True)
class CandidatePlace:
    """A candidate: one tracker at one place (see `harness.body.mounts.Mount`). A moved candidate has a new name."""

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
    """Errors of one set under the study's own conditions."""

    stations: StationNames
    rate_hz: float
    """Rate at which the line carries that many stations [Hz]."""
    errors: dict[str, float | None]
    """Unit of statistics -> error (see `compare.units`); None where it was not measured. Older findings have clips."""
    mean: float | None
    """Mean over the units that were measured."""
    low: float | None = None
    """Ends of the 95 % interval of the mean over units; None with too few."""
    high: float | None = None


@dataclass(frozen=True)
class RankedSet:
    """One set in a ranking."""

    stations: StationNames
    rank: int
    """Rank by mean error; 1 is the best."""
    rank_low: int
    """Best rank that the paired intervals allow: 1 plus the number of sets that are significantly better."""
    rank_high: int
    """Worst rank that they allow: the number of sets minus those that are significantly worse."""
    difference: float | None
    """Mean paired difference over units to the set of rank 1, positive if that set is better; 0 for rank 1."""
    low: float | None = None
    """Ends of the 95 % interval of `difference`."""
    high: float | None = None
    tied: bool = False
    """Whether the set is not significantly worse than rank 1; true for rank 1."""
    step: float | None = None
    """Mean paired difference to the set of the previous rank; 0 for rank 1."""
    step_low: float | None = None
    step_high: float | None = None
    units: int = 0
    """Number of units on which a search by halves measured the set; 0 where every set was measured on the same."""


@dataclass(frozen=True)
class Ranking:
    """A ranking of sets, best first."""

    mode: PlacementMode
    title: str
    """Title, such as "3 trackers of 12"."""
    rows: tuple[RankedSet, ...]
    base: StationNames = ()
    """The set that `ablate` removes from and `add` adds to."""


@dataclass(frozen=True)
class MarginalContribution:
    """Contribution of one candidate: the error without it minus the error with it."""

    candidate: str
    mode: Literal["ablate", "add", "exhaustive"]
    """`ablate`: removed from `base`; `add`: added to it; `exhaustive`: mean with it against without, over all sets."""
    base: StationNames
    difference: float | None
    """Difference in the metric's unit, positive if wearing the candidate helps."""
    low: float | None = None
    high: float | None = None
    clips: int = 0


@dataclass(frozen=True)
class SearchStep:
    """One step of a search: the chosen set, compared with the previous one."""

    stations: StationNames
    changed: str
    """The change, such as "+ left_ankle" or "left_ankle: along 0.90 to 0.80"; "" for the first set."""
    difference: float | None = None
    """Previous error minus new error, positive if the step helps."""
    low: float | None = None
    high: float | None = None
    tied: tuple[str, ...] = ()
    """Alternatives that are not significantly worse."""


@dataclass(frozen=True)
class PlacementSearch:
    """A stepwise search."""

    mode: Literal["greedy", "refine"]
    title: str
    steps: tuple[SearchStep, ...]
    ended: str = ""
    """Reason why the search ended."""
    held_out: float | None = None
    """Error of the first set minus that of the last on held-out clips; None if it was not evaluated."""
    held_out_low: float | None = None
    held_out_high: float | None = None
    held_out_clips: int = 0


@dataclass(frozen=True)
class BestSet:
    """The set with the smallest error among those with the same number of stations."""

    stations: StationNames
    ties: tuple[StationNames, ...] = ()
    """Sets of the same size that are not significantly worse."""
    on_front: bool = True
    """Whether no set of fewer or as many stations has a smaller error (Pareto front)."""
    of: int = 0
    """Number of sets of this size that it was chosen from."""
    selection_stability: float | None = None
    """Share of resamples of the units in which it is still the best."""
    cross_validated_error: float | None = None
    """Cross-validated error: the mean over units of the error of the set that the other units would have chosen.

    It exceeds the mean error by the optimism of choosing and evaluating on the same units.
    """
    held_out: float | None = None
    """Mean error on the held-out clips."""
    held_out_low: float | None = None
    held_out_high: float | None = None
    held_out_clips: int = 0


@dataclass(frozen=True)
class PlacementCondition:
    """Station sets under another condition: another behaviour, method or noise."""

    name: str
    """Name, such as "boxing" or "ik"; the first condition is the study's own."""
    kind: str
    """What differs, such as "behaviour", "method" or "noise"."""
    best: dict[str, StationNames]
    """Number of stations (as text, for JSON) -> the best set under this condition."""
    means: tuple[float | None, ...]
    """Mean error of each set of `PlacementFindings.compared`."""
    clips: int = 0
    selection_stability: float | None = None
    """Share of resamples of the units in which the best of the compared sets is still the best."""


@dataclass(frozen=True)
class ChangedOrder:
    """Two sets whose order differs between two conditions."""

    first: StationNames
    """The set that is better under the first condition."""
    second: StationNames
    differences: tuple[float, float]
    """Mean error of `second` minus that of `first`, under either condition, positive where `first` is better."""
    significant: bool | None = None
    """Whether the change of the difference is significant: sign flips over units, corrected for all pairs of sets. None
    if it was not tested: the conditions have different or few units, or there are many sets."""


@dataclass(frozen=True)
class RankAgreement:
    """Agreement of two conditions on the ranking of the sets that both measured."""

    a: str
    b: str
    tau: float | None
    """Kendall's tau-b over the sets: 1 for the same order, 0 for none, -1 for the reversed order."""
    sets: int
    low: float | None = None
    """Ends of the 95 % interval that the decided pairs leave (see `compare.rank_correlation`); None if unknown."""
    high: float | None = None
    changed: tuple[ChangedOrder, ...] = ()
    """The first pairs of sets whose order differs: the significant changes first, then the largest."""
    changes: int = 0
    """Number of pairs whose order differs."""
    significant_changes: int = 0
    """Number of them that are significant."""


@dataclass(frozen=True)
class StatisticalPower:
    """What the units of a study can show, estimated from its first sets before the others ran."""

    clips: int
    """Number of units on which sets are compared."""
    sets: int
    """Number of sets that are compared with each other."""
    unit: str
    """Unit of `spread`, `shown` and `wanted`."""
    least_clips: int
    """Least number of units with which any difference between so many sets can be significant."""
    duration_s: float | None = None
    """Estimated duration of the whole study [s]; None if no cell was measured."""
    least_duration_s: float | None = None
    """Estimated duration of the study with `least_clips` clips [s]."""
    cell_s: float | None = None
    """Duration of a cell on one worker [s], the median of the first sets."""
    spread: float | None = None
    """Standard deviation of paired differences between sets over units, in the metric's unit; None if unknown."""
    shown: float | None = None
    """Smallest difference that is found with probability 0.8; None if none can be significant or it is unknown."""
    wanted: float | None = None
    """A tenth of the mean error of the first sets."""
    needed_clips: int | None = None
    """Number of units that would show a difference of `wanted`."""
    needed_duration_s: float | None = None
    """Estimated duration of the study with `needed_clips` clips [s]."""
    pilot_sets: int = 0
    """Number of sets that were measured first."""


@dataclass(frozen=True)
class PlacementFindings:
    """Findings of a placement study: findings.json in its folder."""

    name: str
    title: str
    """The question in one line."""
    metric: str
    unit: str
    motion: str
    """Title of the motion source, such as "built-in performer"."""
    behaviours: tuple[str, ...]
    methods: tuple[str, ...]
    noise: str
    link: str
    """Text that says how many stations the line carries at which rate; "" if the rate is the same for all."""
    seed: int
    command: str
    candidates: tuple[CandidatePlace, ...]
    tried: tuple[StationSetResult, ...]
    best: tuple[BestSet, ...]
    """Best set for each number of stations, smallest first."""
    circumstances: dict[str, Any]
    """See `manifest.current_circumstances`."""
    rankings: tuple[Ranking, ...] = ()
    searches: tuple[PlacementSearch, ...] = ()
    contributions: tuple[MarginalContribution, ...] = ()
    compared: tuple[StationNames, ...] = ()
    """The sets that every condition ranks."""
    conditions: tuple[PlacementCondition, ...] = ()
    agreements: tuple[RankAgreement, ...] = ()
    """Agreement of each pair of conditions."""
    claims: tuple[BenchmarkStatement, ...] = ()
    """Claims of papers and our results."""
    notes: tuple[str, ...] = ()
    """Notes for readers: negative results, and omissions with their reasons."""
    failures: dict[str, str] = field(default_factory=dict)
    """Failed cell -> reason."""
    planned: int = 0
    """Number of planned cells."""
    sizes: tuple[int, ...] = ()
    """The numbers of stations that were asked about; () for the smallest number that suffices."""
    power: StatisticalPower | None = None
    """What the units can show; None in findings of versions that did not estimate it."""
    better: Literal["lower", "higher"] = "lower"
    """Which values of the metric are better; all differences are signed accordingly."""
    effort: Effort = ""
    split: Literal["", "known", "new"] = ""
    """Whether methods learnt from other takes of the tested performers (known) or from other performers (new)."""
    base: StationNames = ()
    """Stations that every set contains."""
    station_costs: dict[str, float] = field(default_factory=dict)
    """Candidate -> its cost; {} if the number of stations is the cost."""
    rounds: tuple[HalvingRound, ...] = ()
    """The search by halves, round by round."""
    advice: PlacementAdvice | None = None
    """What is recommended; None in findings of a study in a file, and where nothing was measured."""
    size_steps: tuple[SizeStep, ...] = ()
    """Each two of the best sets of the asked sizes (with costs: of the sets on the front), compared."""
    front: tuple[SetError, ...] = ()
    """The Pareto front of cost and error, the cheapest set first; () without costs."""
    second: SecondMethod | None = None
    kind: Literal["placement"] = "placement"
    schema: int = SCHEMA

    def of(self, stations: StationNames) -> StationSetResult | None:
        """Result of a set, None if it was not tried."""
        return next((tried for tried in self.tried if tried.stations == stations), None)


def write_placement(path: Path, findings: PlacementFindings) -> None:
    """Write findings as JSON with a digest."""
    write_record(path, findings)


def read_placement(path: Path) -> PlacementFindings:
    """Read the findings of a placement study.

    BadFile when the file is missing, damaged, edited, malformed, of another version or study, or names unknown
    candidates.
    """
    expected, advice = "the findings of a placement study", "Give the command of the study again."
    findings = read_record(PlacementFindings, path, expected, advice, _rename_keys)
    if strangers := _unknown_stations(findings):
        raise BadFile(path, f"names {strangers[0]!r}, which is no candidate of it", expected, advice)
    identity = {"placement": findings.name, "motion": findings.motion, "seed": findings.seed}
    check_study(path, identity, expected, advice)
    return findings


def _rename_keys(content: dict[str, Any]) -> dict[str, Any]:
    """The content with today's keys: of the findings, their best sets and their conditions."""
    renamed = {_RENAMED_KEYS.get(key, key): value for key, value in content.items()}
    for name in ("best", "conditions"):
        if isinstance(rows := renamed.get(name), list):
            renamed[name] = [
                {_RENAMED_KEYS.get(key, key): value for key, value in row.items()} if isinstance(row, dict) else row
                for row in rows
            ]
    return renamed


def _unknown_stations(findings: PlacementFindings) -> list[str]:
    """Names of stations that are not among the candidates."""
    known = {place.name for place in findings.candidates}
    sets = [tried.stations for tried in findings.tried]
    sets += [row.stations for ranking in findings.rankings for row in ranking.rows]
    sets += [step.stations for search in findings.searches for step in search.steps]
    sets += [stations for best in findings.best for stations in (best.stations, *best.ties)]
    sets += [rounds.base for rounds in findings.rounds] + [findings.base, tuple(findings.station_costs)]
    sets += [stations for step in findings.size_steps for stations in (step.smaller, step.larger)]
    sets += [point.stations for point in findings.front]
    if findings.advice:
        sets += [findings.advice.best.stations, *findings.advice.ties]
    if findings.second:
        sets += [stations for one in findings.second.choices for stations in (one.chosen, one.best)]
        sets += [one.shared.stations for one in findings.second.choices if one.shared]
    sets += [*findings.compared, *((contribution.candidate,) for contribution in findings.contributions)]
    return sorted({name for stations in sets for name in stations} - known)
