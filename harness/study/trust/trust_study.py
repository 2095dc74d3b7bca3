"""The trust study: does the fitted simulation rank methods as the device does, on the same motion?

The device's captures and simulations of the same takes are evaluated arm by arm (`arm_results`). Then both sides are
compared: health of the streams, errors of the readings, equivalence of each metric, and the order of pairs of arms.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from harness.compare import count_units, holm
from harness.core.arrays import Floats
from harness.core.progress import ProgressCallback
from harness.errors import BadFile, BadInput, HarnessError, Outcome, shorten
from harness.experiment import clear_caches
from harness.experiment.scenarios import FITTED_PRESET, Scenario, load_scenario, read_fitted_unit
from harness.experiment.workers import TaskExecutor, run_in_process
from harness.measure import UnitFile
from harness.mocap import LibraryFolders
from harness.results import open_study
from harness.results.files import FINDINGS, file_digest, write_result_json
from harness.results.findings import (
    Equivalence,
    ErrorDistance,
    PairAgreement,
    StationHealth,
    TrustCapture,
    TrustFindings,
)
from harness.stream import PoseFileOptions
from harness.stream.recording import PLAN_FILE, read_recording
from harness.study.trust.arm_results import Arm, ArmResults, TrustTask, find_stations, run_capture
from harness.study.trust.pair_agreement import (
    ArmErrors,
    average_performers,
    clip_means,
    correlate_ranks,
    judge_equivalence,
    judge_pairs,
    unit_of,
)
from harness.study.trust.plan import Plan, load_plan, parameter_variants, plan_digest, scenario_file, unit_file
from harness.study.trust.pose_source import holds_poses, read_poses
from harness.study.trust.reading_errors import (
    CORRELATION_TIMES,
    FEATURES,
    HealthCounts,
    compare_errors,
    correlation_samples,
)


class OtherPlan(HarnessError):
    """A capture that was not made for the plan, or not in all of its parts."""

    outcome = Outcome.NOT_COMPARABLE

    def __init__(self, capture: str, found: Sequence[str], plan: str) -> None:
        super().__init__(capture, tuple(found), plan)
        self.capture, self.found, self.plan = self.args

    def __str__(self) -> str:
        if not any(self.found):
            carried = "names no plan"
        elif len(self.found) == 1:
            carried = f"carries the digest {self.found[0][:12]} of another plan"
        else:
            names = ", then ".join(f"the digest {digest[:12]}" if digest else "no plan" for digest in self.found)
            carried = f"carries {names}: the plan was written after data, or renewed"
        advice = "Use the plan it was recorded with (`harness record --plan`), or add --exploratory."
        return f"{shorten(self.capture)} {carried}, not {self.plan[:12]}. {advice}"


@dataclass(frozen=True)
class TrustStudy:
    """A finished study."""

    findings: TrustFindings
    methods_s: float
    """Time that training and methods took, over all workers [s]."""


def run_trust_study(
    path: Path,
    captures: Sequence[Path],
    out: Path,
    *,
    clips: Sequence[str] = (),
    folder: LibraryFolders | None = None,
    exploratory: bool = False,
    executor: TaskExecutor = run_in_process,
    progress: ProgressCallback = lambda cell, done, planned: None,
) -> TrustStudy:
    """Run or resume a study in the folder `out`; `clips` names the clip of each capture, if the captures do not.

    The same plan and captures give the same findings, also after a stop. OtherPlan for a capture of another plan,
    unless `exploratory`. BadFile, BadInput and UnknownName for a plan, unit file or capture that cannot be used, and
    for a folder of another study.
    """
    plan, digest = load_plan(path), plan_digest(path)
    if not captures or (clips and len(clips) != len(captures)):
        raise BadInput(f"{len(clips)} clips for {len(captures)} captures.", "Name one clip for each capture, or none.")
    carried = [_carried_plans(capture) for capture in captures]
    digests = [file_digest(capture, "a capture", "") for capture in captures]
    if len(set(digests)) < len(digests):
        raise BadInput("A capture is named twice, or a copy of it.", "Name each once.")
    for capture, found in zip(captures, carried, strict=True):
        if found != (digest,) and not exploratory:
            raise OtherPlan(str(capture), found, digest)
    scenario = load_scenario(scenario_file(plan, path))
    unit = unit_file(plan, path)
    fitted = None if unit is None else read_fitted_unit(unit)
    task = TrustTask(
        capture=Path(),
        clip="",
        scenario_file=scenario_file(plan, path),
        arms=plan_arms(plan, scenario),
        parameters=plan.parameters,
        metrics=tuple(plan.margins),
        seeds=plan.seeds,
        unit=None if fitted is None else _unit_keys(fitted),
        out=out,
        folder=folder,
    )
    tasks = [
        replace(task, capture=capture, clip=clip)
        for capture, clip in zip(captures, clips or [""] * len(captures), strict=True)
    ]
    clear_caches()
    if len({find_stations(each) for each in tasks}) > 1:
        raise BadInput("The captures have different stations.", "Name captures of one session.")
    identity = {"study": "trust", "plan": digest, "captures": digests}
    with open_study(out, identity):
        (out / "cells").mkdir(exist_ok=True)
        results = _run_tasks(tasks, executor, progress)
        head = TrustFindings(
            title=plan.title or path.stem,
            scenario=plan.scenario,
            unit=plan.unit or scenario.noise_label,
            unit_digest="" if unit is None else file_digest(unit, "a unit file", ""),
            plan_digest=digest,
            exploratory=exploratory and any(found != (digest,) for found in carried),
            level=plan.level,
            ranked_metric=plan.ranked_metric,
            seeds=plan.seeds,
            captures=tuple(
                TrustCapture(capture.name, result.clip, result.sha256, ", ".join(found), result.frames, result.damage)
                for capture, found, result in zip(captures, carried, results, strict=True)
            ),
            arms=tuple(map(str, task.arms)),
            notes=(f"{plan.unit}: {fitted.caveat}.",) if fitted and fitted.caveat else (),
        )
        findings = judge_study(head, plan, task.arms, results)
        write_result_json(out / FINDINGS, {**asdict(findings), "outcome": findings.outcome.word})
    return TrustStudy(findings, sum(result.methods_s for result in results))


def plan_arms(plan: Plan, scenario: Scenario) -> tuple[Arm, ...]:
    """Every method with every set of stations and every combination of parameters."""
    return tuple(
        Arm(method, name, stations, values)
        for values, _ in parameter_variants(plan, scenario)
        for name, stations in plan.stations.items()
        for method in plan.methods
    )


def _run_tasks(tasks: Sequence[TrustTask], executor: TaskExecutor, progress: ProgressCallback) -> list[ArmResults]:
    results: dict[int, ArmResults] = {}
    progress("", 0, len(tasks))
    for which, future in executor(run_capture, [(task,) for task in tasks]):
        results[which] = future.result()
        progress(str(tasks[which].capture), len(results), len(tasks))
    return [results[which] for which in range(len(tasks))]


def judge_study(head: TrustFindings, plan: Plan, arms: Sequence[Arm], results: Sequence[ArmResults]) -> TrustFindings:
    """The findings with both sides compared, and the outcome."""
    device, simulated = collect_errors(results, plan.ranked_metric, plan.performers)
    equivalences = []
    for metric, margin in plan.margins.items():
        sides = collect_errors(results, metric, plan.performers)
        for arm in map(str, arms):
            means = [clip_means(side.get(arm, {})) for side in sides]
            equivalences.append(judge_equivalence(arm, metric, means[0], means[1], margin, plan.level))
    pairs = judge_pairs(device, simulated, plan.level, comparable_pairs(arms))
    failures = {cell: why for result in results for cell, why in result.failures.items()}
    outcome, why = judge_outcome(equivalences, pairs, failures)
    unmeasured = sum(
        value is None
        for result in results
        for cell in (*result.device.values(), *(each for seeds in result.simulated.values() for each in seeds))
        for value in cell.values()
    )
    notes = [*head.notes, _describe_units(plan, results), *(note for result in results for note in result.notes)]
    if unmeasured:
        notes.append(f"{unmeasured} errors were not measured: too few frames have an estimate.")
    return replace(
        head,
        health=_compare_health(results),
        distances=_compare_readings(results),
        equivalences=tuple(equivalences),
        pairs=tuple(pairs),
        rank_correlations=correlate_ranks(device, simulated),
        failures=failures,
        outcome=outcome,
        why=why,
        notes=tuple(notes),
    )


def _describe_units(plan: Plan, results: Sequence[ArmResults]) -> str:
    """The units of the statistics, in a sentence or two."""
    captured = dict.fromkeys(result.clip for result in results)
    counted = f"Units of the statistics: {count_units(unit_of(clip, plan.performers) for clip in captured)}."
    if not plan.performers:
        return f"{counted} The plan declares no performers, so that each motion is a unit, whoever performed it."
    alone = [clip for clip in captured if clip not in plan.performers]
    return f"{counted} No performer is declared for {', '.join(alone)}." if alone else counted


def collect_errors(
    results: Sequence[ArmResults], metric: str, performers: Mapping[str, str] | None = None
) -> tuple[ArmErrors, ArmErrors]:
    """Errors of both sides; captures of one clip are values of that clip, and its simulations count once.

    Clips of one of the `performers` (clip -> performer) become one unit (see `average_performers`).
    """
    device: dict[str, dict[str, list[float | None]]] = {}
    simulated: dict[str, dict[str, list[float | None]]] = {}
    for result in results:
        for arm, seeds in result.simulated.items():
            device.setdefault(arm, {}).setdefault(result.clip, []).append(result.device.get(arm, {}).get(metric))
            simulated.setdefault(arm, {})[result.clip] = [errors.get(metric) for errors in seeds]
    known = performers or {}
    return average_performers(device, known, paired=False), average_performers(simulated, known, paired=True)


def comparable_pairs(arms: Sequence[Arm]) -> list[tuple[str, str]]:
    """Pairs of arms that differ in one thing alone: the method, the set of stations, or the parameters."""
    return [
        (str(a), str(b))
        for a, b in combinations(arms, 2)
        if (a.method != b.method) + (a.set_name != b.set_name) + (a.values != b.values) == 1
    ]


def judge_outcome(
    equivalences: Sequence[Equivalence], pairs: Sequence[PairAgreement], failures: Mapping[str, str]
) -> tuple[Outcome, str]:
    """The first that applies: REGRESSED, INCOMPLETE, NOT_COMPARABLE, PASS; and why, in one sentence.

    A contradicted pair and a metric beyond its margin are REGRESSED, failed cells INCOMPLETE. NOT_COMPARABLE is a
    metric that cannot be told, and pairs of which none agrees. Single pairs that cannot be told are no fault: arms may
    be equally good.
    """
    contradicted = [pair for pair in pairs if pair.verdict == "contradict"]
    beyond = [line for line in equivalences if line.verdict == "beyond the margin"]
    if contradicted or beyond:
        parts = [f"{pair.a} and {pair.b} contradict" for pair in contradicted[:1]]
        parts += [f"{line.metric} of {line.arm} lies beyond its margin" for line in beyond[:1]]
        more = len(contradicted) + len(beyond) - len(parts)
        return Outcome.REGRESSED, "; ".join(parts) + (f"; and {more} more" if more else "") + "."
    if failures:
        return Outcome.INCOMPLETE, f"{len(failures)} cells failed, the first: {next(iter(failures))}."
    undecided = [line for line in equivalences if line.verdict == "cannot tell"]
    if undecided:
        first = undecided[0]
        text = f"{first.metric} of {first.arm} cannot be told: {first.why}"
        more = len(undecided) - 1
        return Outcome.NOT_COMPARABLE, text + (f"; and {more} more." if more else ".")
    if pairs and not any(pair.verdict == "agree" for pair in pairs):
        return Outcome.NOT_COMPARABLE, f"none of {len(pairs)} pairs can be ordered on both sides."
    agreeing = sum(pair.verdict == "agree" for pair in pairs)
    return Outcome.PASS, f"every metric is equivalent, {agreeing} of {len(pairs)} pairs agree, none contradicts."


def _compare_health(results: Sequence[ArmResults]) -> tuple[StationHealth, ...]:
    rows = []
    for k, station in enumerate(results[0].stations):
        sides = []
        for side in (0, 1):
            total = HealthCounts()
            for result in results:
                total = total.add(result.health[side][k])
            sides.append(total.as_health())
        rows.append(StationHealth(station, sides[0], sides[1]))
    return tuple(rows)


def _compare_readings(results: Sequence[ArmResults]) -> tuple[ErrorDistance, ...]:
    """Energy distance of each station and each kind of error, with Holm's correction over all rows."""
    rows = [
        _compare_station(results, k, station, feature, unit)
        for k, station in enumerate(results[0].stations)
        for feature, unit in FEATURES.items()
    ]
    tested = [at for at, row in enumerate(rows) if row.p is not None]
    corrected = dict(zip(tested, holm([rows[at].p or 0.0 for at in tested]), strict=True))
    return tuple(replace(row, p_holm=corrected.get(at)) for at, row in enumerate(rows))


def _compare_station(results: Sequence[ArmResults], k: int, station: str, feature: str, unit: str) -> ErrorDistance:
    rate_hz = results[0].rate_hz
    sides: list[list[Floats]] = [
        [series[:, k] for result in results for series in result.readings[side][feature]] for side in (0, 1)
    ]
    try:
        length = int(np.ceil(CORRELATION_TIMES * max(map(correlation_samples, sides))))
        found = compare_errors(sides[0], sides[1], length)
    except BadInput as error:
        return ErrorDistance(station, feature, unit, None, None, None, None, 0.0, (0, 0), str(error))
    return ErrorDistance(
        station, feature, unit, found.distance, found.split_half, found.p, None, length / rate_hz, found.blocks
    )


def _carried_plans(path: Path) -> tuple[str, ...]:
    """Digests of the plans that a capture's notes carry; BadFile for notes of different clips."""
    if holds_poses(path):
        return (read_poses([path], PoseFileOptions()).plan,)
    capture = read_recording(path)
    if len(clips := capture.note_values("clip")) > 1:
        found = f"notes of different clips ({', '.join(clip or 'none' for clip in clips)})"
        raise BadFile(path, found, "one clip", "Record each clip into a file of its own.")
    return capture.note_values(PLAN_FILE)


def _unit_keys(unit: UnitFile) -> dict[str, Any]:
    """Scenario keys that a fitted unit replaces."""
    return {"noise": FITTED_PRESET, "profile": unit.name, "components": unit.components, "tracker": unit.tracker}
