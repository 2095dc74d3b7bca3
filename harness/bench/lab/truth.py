"""The truth table of a lab's verbs: in how many captures each planted fault is named, and with which size.

In how many captures of a known unit each interval contains the true parameter, stands there too.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from harness.bench.lab.captures import (
    EARLIER,
    NO_FAULT,
    NO_FAULTS,
    PLANTED_FAULTS,
    PlantedNumber,
    needed_captures,
    planted_motion,
    planted_numbers,
)
from harness.bench.lab.outcomes import CaptureOutcome, StoredCheck, collect_outcomes
from harness.bench.lab.planted_worlds import trust_rows
from harness.bench.lab.validated_captures import registration_rows
from harness.bench.limits import state_verdict
from harness.core.progress import ProgressCallback
from harness.experiment.workers import TaskExecutor
from harness.results.findings import BenchmarkStatement
from harness.study.trust.characterization import preset_values

SEEDS = tuple(range(1, 101))
"""Seeds of the captures. Constants of the estimators were chosen on captures with seeds from 1001 on."""
TOLERANCE = 0.2
"""Relative error of a size that is as good as lying within its interval."""
LEAST, MOST = 0.90, 0.99
"""Shares of the captures between which the coverage of a 95 % interval has to lie."""
KINDS = tuple(kind for kind in PLANTED_FAULTS if kind != EARLIER)
"""Kinds of captures, a row each."""


def lab_truth_rows(
    seeds: Sequence[int], out: Path, executor: TaskExecutor, progress: ProgressCallback
) -> list[BenchmarkStatement]:
    """All rows: the planted faults, the coverage of the fitted parameters, and the planted worlds of trust.

    Outcomes of single captures are kept in `out` and used again. Coverage is over twice as many captures without a
    fault as there are seeds.
    """
    more = range(max(seeds) + 1, max(seeds) + 1 + len(seeds))
    tasks = [(kind, seed) for seed in seeds for kind in KINDS] + [(NO_FAULT, seed) for seed in more]
    outcomes = collect_outcomes(tasks, out, executor, progress)
    clean = [outcomes[NO_FAULT, seed] for seed in (*seeds, *more)]
    errors = [outcome.errors for seed in seeds if (outcome := outcomes["none_validated", seed]).errors]
    return [
        *fault_rows(seeds, outcomes),
        *registration_rows(errors, len(seeds)),
        *coverage_rows(clean),
        *trust_rows(seeds),
    ]


def fault_rows(seeds: Sequence[int], outcomes: Mapping[tuple[str, int], CaptureOutcome]) -> list[BenchmarkStatement]:
    """One row for each kind of capture, over its captures of these seeds."""
    return [fault_row(kind, [outcomes[kind, seed] for seed in seeds]) for kind in KINDS]


def fault_row(kind: str, outcomes: Sequence[CaptureOutcome]) -> BenchmarkStatement:
    """The row of one kind of capture."""
    fault, count, needed = PLANTED_FAULTS[kind], len(outcomes), needed_captures(len(outcomes))
    minutes = min(planted_motion(kind, 1).duration_s, fault.seconds) / 60.0
    title, notes = f"{fault.verb}, {fault.title}, {minutes:.3g} min", _notes(kind, outcomes)
    named, sized = ([judge(outcome) for outcome in outcomes] for judge in (_is_named, _is_sized))
    what, found, measured = "named", sum(named), ""
    if kind in NO_FAULTS:
        what, found = "none named", sum(outcome.names_nothing for outcome in outcomes)
    elif fault.numbers:
        what, found = "named with its size", sum(n and s for n, s in zip(named, sized, strict=True))
        measured = f"named in {sum(named)}, its size in {sum(sized)}, both in {found}"
    held_to = f"{what} in {needed} of {count}"
    return state_verdict(title, held_to, measured or f"in {found}", found >= needed, "", notes)


def is_sized(planted: PlantedNumber, check: StoredCheck) -> bool:
    """Whether a measured number is within `TOLERANCE` of the planted one, or has it within its interval."""
    value = planted.value + (check.expected if planted.is_change else 0.0)
    return abs(check.value - value) <= TOLERANCE * abs(planted.value) or check.contains(value)


def _is_named(outcome: CaptureOutcome) -> bool:
    named = {(check.key, check.station) for check in outcome.named}
    planted = planted_numbers(outcome.kind, outcome.seed)
    exchanged = PLANTED_FAULTS[outcome.kind].exchanged
    return all((one.key, one.station) in named for one in planted) and outcome.exchanged == exchanged


def _is_sized(outcome: CaptureOutcome) -> bool:
    checks = {(check.key, check.station): check for check in outcome.checks}
    found = [(one, checks.get((one.key, one.station))) for one in planted_numbers(outcome.kind, outcome.seed)]
    return not outcome.failure and all(check is not None and is_sized(one, check) for one, check in found)


def _notes(kind: str, outcomes: Sequence[CaptureOutcome]) -> str:
    """What else was named, and what was refused, with the numbers of captures."""
    parts = []
    others: Counter[str] = Counter()
    for outcome in outcomes:
        planted = {(one.key, one.station) for one in planted_numbers(kind, outcome.seed)}
        further = {check.key for check in outcome.named if (check.key, check.station) not in planted}
        if outcome.exchanged != PLANTED_FAULTS[kind].exchanged:
            further.add(f"exchanged stations ({', '.join(outcome.exchanged) or 'none'})")
        others.update(further)
    if others:
        listed = ", ".join(f"{key} in {number}" for key, number in others.most_common())
        parts.append(f"{'named' if kind in NO_FAULTS else 'also named'}: {listed}")
    if refused := [outcome.failure for outcome in outcomes if outcome.failure]:
        parts.append(f"refused in {len(refused)}: {refused[0]}")
    return "; ".join(parts)


def coverage_rows(outcomes: Sequence[CaptureOutcome]) -> list[BenchmarkStatement]:
    """One row for each parameter that was measured in any of the captures without a fault.

    The true parameters are those of the preset `default`, with which the captures were made.
    """
    known = {key: number.value for key, number in preset_values().items()}
    found: dict[str, list[bool]] = {}
    for outcome in outcomes:
        for number in outcome.parameters:
            if number.key in known:
                found.setdefault(number.key, []).append(number.contains(known[number.key]))
    return [coverage_row(key, covered, len(outcomes)) for key, covered in found.items()]


def coverage_row(key: str, covered: Sequence[bool], captures: int) -> BenchmarkStatement:
    """The row of a parameter whose interval contains the true value or not in the captures that measured it."""
    count, share = sum(covered), sum(covered) / len(covered)
    note = "" if len(covered) == captures else f"not measured in {captures - len(covered)} of {captures}"
    return state_verdict(
        f"coverage, {key}",
        f"in {LEAST:.0%} to {MOST:.0%} of {len(covered)}",
        f"in {count} ({share:.1%})",
        LEAST <= share <= MOST,
        "",
        note,
    )
