"""A placement study's findings as the study writes them, made up from candidates of known worth; nothing was measured.

The error of a set is a constant less what its stations are worth, plus noise by clip and condition; so the truth about
every figure on the page is known.
"""

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from harness.compare.paired_statistics import MIN_UNITS, PairedDifference
from harness.core.seeds import generator
from harness.results.benchmark_statement import BenchmarkStatement
from harness.results.placement_findings import (
    BestSet,
    CandidatePlace,
    MarginalContribution,
    PlacementCondition,
    PlacementFindings,
    PlacementSearch,
    RankAgreement,
    RankedSet,
    Ranking,
    SearchStep,
    StationNames,
    StationSetResult,
    write_placement,
)

PLACES = (
    CandidatePlace("head", "head", 1.0, 0.0),
    CandidatePlace("sternum", "thorax", 0.5, 0.0),
    CandidatePlace("pelvis", "lhipjoint", 0.0, 165.0),
    CandidatePlace("left_hand", "lhand", 1.0, -90.0, side="left"),
    CandidatePlace("right_hand", "rhand", 1.0, 90.0, side="right"),
    CandidatePlace("left_upper_arm", "lhumerus", 0.5, -90.0, side="left"),
    CandidatePlace("right_upper_arm", "rhumerus", 0.5, 90.0, side="right"),
    CandidatePlace("left_thigh", "lfemur", 0.6, -90.0, side="left"),
    CandidatePlace("right_thigh", "rfemur", 0.6, 90.0, side="right"),
    CandidatePlace("left_ankle", "ltibia", 0.9, -90.0, side="left"),
    CandidatePlace("right_ankle", "rtibia", 0.9, 90.0, side="right"),
)
WORTH = {
    "walking": (0.1, 0.3, 0.9, 0.25, 0.25, 0.1, 0.1, 0.5, 0.5, 1.1, 1.1),
    "boxing": (0.2, 0.4, 0.9, 1.0, 1.0, 0.6, 0.6, 0.2, 0.2, 0.3, 0.3),
}
"""What each of the places above takes off the error [deg]."""
CLIPS = tuple(f"p{n}_walking_{n}" for n in range(1, 9))
_AT_MOST = 3
Errors = Mapping[StationNames, Mapping[str, float]]


def made_up(clips: Sequence[str] = CLIPS, at_most: int = _AT_MOST) -> PlacementFindings:
    """Findings with every kind of figure, claim and failure."""
    names = tuple(place.name for place in PLACES)
    sets = [stations for size in range(1, at_most + 1) for stations in itertools.combinations(names, size)]
    errors, elsewhere = _errors(sets, "walking", clips), _errors(sets, "boxing", clips)
    whole = _errors([names, *(_without(names, name) for name in names)], "walking", clips)
    best = [min((s for s in sets if len(s) == size), key=lambda s: _mean(errors[s])) for size in range(1, at_most + 1)]
    rankings = tuple(_ranking(f"{n} of {len(names)} places", [s for s in sets if len(s) == n], errors) for n in (2, 3))
    base = best[-1]
    added = {(*sorted((*base, name), key=names.index),): name for name in names if name not in base}
    more = _errors(list(added), "walking", clips)
    tried = [_tried(stations, {**whole, **errors, **more}[stations]) for stations in {**whole, **errors, **more}]
    walking, boxing = (_condition(name, found, sets) for name, found in (("walking", errors), ("boxing", elsewhere)))
    noisy = PlacementCondition(
        "default*", "noise", walking.best, tuple(m and 1.1 * m for m in walking.means), len(clips)
    )
    return PlacementFindings(
        name="placement_walking",
        title="Which of eleven places serve walking best?",
        metric="joint_angle_mean_deg",
        unit="deg",
        motion="built-in performer",
        behaviours=("walking",),
        methods=("ik", "local_pca"),
        noise="default",
        link="115200 baud carry 3 stations at 100 Hz, 6 at 50 Hz, 11 at 27 Hz",
        seed=1,
        command="harness placement scenarios/placement_walking.toml",
        candidates=PLACES,
        tried=tuple(tried),
        best=tuple(_best(s, _ties(s, sets, errors), errors) for s in best),
        circumstances={"harness": "0.1.0", "commit": "0123456789abcdef", "dirty": False, "python": "3.11.2"},
        rankings=rankings,
        searches=(_greedy(best, errors),),
        contributions=(
            *(_worth(name, "ablate", names, whole[_without(names, name)], whole[names]) for name in names),
            *(_worth(name, "add", base, errors[base], more[stations]) for stations, name in added.items()),
        ),
        compared=tuple(sets),
        conditions=(walking, boxing, noisy),
        agreements=(
            RankAgreement("walking", "boxing", 0.31, len(sets), 0.22, 0.4),
            RankAgreement("walking", "default*", 1.0, len(sets)),
            RankAgreement("boxing", "default*", 0.31, len(sets)),
        ),
        claims=(
            BenchmarkStatement(
                "walking: of all sets of 3 both ankles and the pelvis err least (against the best other, ...)",
                "called suitable",
                "1.90 against 2.20 deg",
                "reproduced",
                clips=len(clips),
                value=0.3,
                low=0.21,
                high=0.38,
                unit="deg",
            ),
            BenchmarkStatement(
                "boxing: both hands and the pelvis err least", "called suitable", "", "not run", "walking alone was run"
            ),
        ),
        notes=("A hand is worth less than a thigh here.",),
        failures={"ik on p3_walking_3 (worn=head)": "Traceback (most recent call last):\n  x\nValueError: <b>no</b>"},
        planned=len(clips) * len(tried) * 2,
    )


def write_made_up(folder: Path, findings: PlacementFindings | None = None) -> Path:
    """Write the folder of a study that has only findings."""
    folder.mkdir(parents=True, exist_ok=True)
    write_placement(folder / "findings.json", findings or made_up())
    return folder


def _errors(sets: Sequence[StationNames], behaviour: str, clips: Sequence[str]) -> dict[StationNames, dict[str, float]]:
    """Set -> clip -> error [deg]; the contribution of a station shrinks with the number of others."""
    worth = dict(zip((place.name for place in PLACES), WORTH[behaviour], strict=True))
    found = {}
    for stations in sets:
        left = 5.0 * float(np.exp(-sum(worth[name] for name in stations) / 4.0))
        draws = generator(1, "placement", behaviour, *stations).normal(size=len(clips))
        hard = generator(1, "clips", behaviour).normal(size=len(clips))
        found[stations] = dict(zip(clips, (left + 0.3 * hard + 0.08 * draws).tolist(), strict=True))
    return found


def _tried(stations: StationNames, errors: Mapping[str, float]) -> StationSetResult:
    known = _paired(errors)
    rate_hz = float(min(100, 300 // len(stations)))
    return StationSetResult(stations, rate_hz, dict(errors), known.mean, known.low, known.high)


def _ranking(title: str, sets: Sequence[StationNames], errors: Errors) -> Ranking:
    ranked = sorted(sets, key=lambda stations: _mean(errors[stations]))[:20]
    rows = []
    for rank, stations in enumerate(ranked, start=1):
        behind = _paired(errors[stations], errors[ranked[0]])
        tied = rank == 1 or behind.low is None or behind.low <= 0.0
        low, high = max(1, rank - 2), min(len(sets), rank + 2)
        rows.append(RankedSet(stations, rank, low, high, behind.mean, behind.low, behind.high, tied))
    return Ranking("exhaustive", title, tuple(rows))


def _ties(best: StationNames, sets: Sequence[StationNames], errors: Errors) -> tuple[StationNames, ...]:
    rivals = [(s, _paired(errors[s], errors[best])) for s in sets if len(s) == len(best) and s != best]
    return tuple(stations for stations, behind in rivals if behind.low is None or behind.low <= 0.0)


def _best(stations: StationNames, ties: tuple[StationNames, ...], errors: Errors) -> BestSet:
    """The best set of a size, with a slightly larger error on held-out clips."""
    of, there = sum(len(other) == len(stations) for other in errors), 1.05 * _mean(errors[stations])
    return BestSet(
        stations, ties, True, of, 0.83, there, held_out=there, held_out_low=there - 0.4, held_out_high=there + 0.4,
        held_out_clips=6,
    )  # fmt: skip


def _greedy(path: Sequence[StationNames], errors: Errors) -> PlacementSearch:
    steps = [SearchStep(path[0], f"+ {path[0][0]}")]
    for before, now in itertools.pairwise(path):
        gain = _paired(errors[before], errors[now])
        new = next(iter(set(now) - set(before)))
        steps.append(SearchStep(now, f"+ {new}", gain.mean, gain.low, gain.high, ("head",)))
    return PlacementSearch("greedy", "from none", tuple(steps), "as many as were asked for", 1.2, 0.9, 1.6, 6)


def _worth(
    name: str, mode: str, base: StationNames, less: Mapping[str, float], more: Mapping[str, float]
) -> MarginalContribution:
    gain = _paired(less, more)
    return MarginalContribution(
        name, "add" if mode == "add" else "ablate", base, gain.mean, gain.low, gain.high, len(gain.units)
    )


def _condition(name: str, errors: Errors, sets: Sequence[StationNames]) -> PlacementCondition:
    best = {
        str(n): min((s for s in sets if len(s) == n), key=lambda s: _mean(errors[s]))
        for n in sorted({len(s) for s in sets})
    }
    return PlacementCondition(
        name, "behaviour", best, tuple(_mean(errors[s]) for s in sets), len(next(iter(errors.values())))
    )


def _without(names: StationNames, name: str) -> StationNames:
    return tuple(n for n in names if n != name)


def _paired(a: Mapping[str, float], b: Mapping[str, float] | None = None) -> PairedDifference:
    """A paired difference with a normal-theory interval, which is faster than the bootstrap."""
    values = np.array([a[clip] - (b[clip] if b else 0.0) for clip in a])
    mean, half = float(values.mean()), 2.3 * float(values.std(ddof=1)) / len(values) ** 0.5
    enough = len(values) >= MIN_UNITS
    return PairedDifference(tuple(a), mean, mean - half if enough else None, mean + half if enough else None)


def _mean(errors: Mapping[str, float]) -> float:
    return float(np.mean(list(errors.values())))
