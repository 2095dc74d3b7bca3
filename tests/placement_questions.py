"""Ten questions of placement, each asked twice, and the two answers tried on performers whom neither has seen.

    python -m tests.placement_questions [--questions N] [--jobs 2] [--out DIR]

For each question the advice of `--effort normal` errs at most 3 % more on 32 fresh performers than that of `thorough`,
and a larger advised set never errs more than the best set of a smaller size. All ten take at most two hours of two
quiet cores. Exit code 1 on a miss.
"""

import argparse
import sys
import time
from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from harness.experiment.workers import TaskExecutor, process_executor
from harness.report.placement.wording import set_name
from harness.results import open_study
from harness.results.findings import PlacementFindings, StationNames
from harness.results.findings.advice import Effort
from harness.study.placement.candidates import names_of_places
from harness.study.placement.placement_study import run_placement
from harness.study.placement.plan import plan_study
from harness.study.placement.question import PlacementQuestion, list_sets, question_study
from harness.study.placement.question_clips import FRESH_PERFORMERS, builtin_units
from harness.study.placement.question_run import QuestionRun
from harness.study.placement.ranking import Costs
from harness.study.placement.set_results import SetResults

MOST_RATIO, MOST_HOURS = 1.03, 2.0
LIMBS, TRUNK = ("hand", "ankle", "head", "pelvis"), ("head", "torso", "pelvis", "hand", "thigh")
QUESTIONS = (
    PlacementQuestion(2, 2, ("walking",), ("head", "hand", "pelvis")),
    PlacementQuestion(2, 3, ("boxing",), ("head", "hand", "pelvis")),
    PlacementQuestion(3, 3, ("walking",), (*LIMBS, "thigh"), base=("head",)),
    PlacementQuestion(3, 3, ("table_tennis",), (*LIMBS, "upper_arm")),
    PlacementQuestion(2, 2, ("golf",), (*LIMBS, "thigh")),
    PlacementQuestion(3, 3, ("jumping",), (*LIMBS, "torso", "right_thigh")),
    PlacementQuestion(2, 3, ("walking", "boxing"), LIMBS),
    PlacementQuestion(3, 3, ("boxing",), TRUNK, split="subject"),
    PlacementQuestion(2, 3, ("golf", "table_tennis"), ("upper_arm", "hand", "pelvis"), split="subject"),
    PlacementQuestion(2, 3, ("walking",), TRUNK, base=("pelvis",)),
)
"""Two or three of at most eight places."""


@dataclass(frozen=True)
class Trial:
    """One question after both searches."""

    question: PlacementQuestion
    normal: StationNames
    thorough: StationNames
    errors: dict[StationNames, float]
    """Set -> mean error on the fresh performers [deg]."""
    smaller: tuple[StationNames, ...]
    """The best sets of smaller sizes than the advised one, by the normal search."""
    minutes: float

    @property
    def ratio(self) -> float:
        """Error of the normal advice over that of the thorough one."""
        return self.errors[self.normal] / self.errors[self.thorough]

    @property
    def errs_more(self) -> bool:
        """Whether the advised set errs more than the best of a smaller size."""
        return any(self.errors[self.normal] > self.errors[stations] for stations in self.smaller)

    def row(self) -> str:
        """A line of the table."""
        asked = self.question
        sizes = f"{asked.fewest}-{asked.most}" if asked.fewest < asked.most else f"{asked.most}"
        title = f"{sizes} {'+'.join(asked.behaviours)}{' with ' + '+'.join(asked.base) if asked.base else ''}"
        title += " new" if asked.split == "subject" else ""
        sets = [f"{set_name(one)} {self.errors[one]:.2f}" for one in (self.normal, self.thorough)]
        return f"{title:30} {sets[0]:38} {sets[1]:38} {self.ratio:5.3f}  {'MORE' if self.errs_more else 'no':4} " + (
            f"{self.minutes:6.1f}"
        )


def advised(findings: PlacementFindings) -> StationNames:
    """The advised set of a search, all of whose cells must be there."""
    assert findings.advice is not None
    assert not findings.failures
    return findings.advice.best.stations


def try_question(question: PlacementQuestion, out: Path, executor: TaskExecutor) -> Trial:
    """Ask a question twice in one folder, then measure what was advised on fresh performers."""
    began = time.monotonic()
    efforts: tuple[Effort, Effort] = ("normal", "thorough")
    found = [
        run_placement(replace(question, effort=effort, second_method="none"), out, executor=executor)[0]
        for effort in efforts
    ]
    normal, thorough = map(advised, found)
    smaller = tuple(best.stations for best in found[0].best if len(best.stations) < len(normal))
    errors = fresh_errors(question, dict.fromkeys((normal, thorough, *smaller)), out / "fresh", executor)
    return Trial(question, normal, thorough, errors, smaller, (time.monotonic() - began) / 60.0)


def fresh_errors(
    question: PlacementQuestion, sets: Iterable[StationNames], out: Path, executor: TaskExecutor
) -> dict[StationNames, float]:
    """Mean errors of sets on the fresh performers [deg]."""
    asked = question_study(question, None)
    plan = plan_study(asked.study, lambda name: asked.scenario, None)
    listed = {names_of_places(s): s for size in asked.study.sizes for s in list_sets(size, plan.groups, asked.base)}
    with open_study(out, {"placement": asked.study.name, "motion": plan.motion, "seed": asked.scenario.seed}):
        (out / "cells").mkdir(exist_ok=True)
        cache = SetResults(out, None, executor, "", lambda last, done, planned: None, plan.study.link)
        run = QuestionRun(plan, cache, asked, lambda line: None)
        units = builtin_units(FRESH_PERFORMERS, tuple(dict.fromkeys(question.behaviours)))
        errors = run.measure_on(plan.scenario, units, [listed[names] for names in sets])
    return {names_of_places(stations): mean_error(by_unit) for stations, by_unit in errors.items()}


def mean_error(by_unit: Costs) -> float:
    """The mean over performers, all of whom must have been measured."""
    values = [value for value in by_unit.values() if value is not None]
    assert len(values) == len(FRESH_PERFORMERS)
    return float(np.mean(values))


def main() -> int:
    """Ask the questions, print the table and the verdict."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--questions", type=int, default=len(QUESTIONS), help="the first so many")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("results/placement_questions"))
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    columns = f"{'question':30} {'normal [deg]':38} {'thorough [deg]':38} ratio  more  minutes"
    print(columns, flush=True)
    trials = []
    with ExitStack() as stack:
        executor = stack.enter_context(process_executor(args.jobs))
        for number, question in enumerate(QUESTIONS[: args.questions], start=1):
            trials.append(try_question(question, args.out / f"question_{number}", executor))
            print(trials[-1].row(), flush=True)
    worst, hours = max(trial.ratio for trial in trials), sum(trial.minutes for trial in trials) / 60.0
    missed = [trial for trial in trials if trial.ratio > MOST_RATIO or trial.errs_more]
    counted = f"{len(trials)} questions: largest ratio {worst:.3f} (at most {MOST_RATIO}), {hours:.1f} h"
    late = f"; target of {MOST_HOURS:g} h missed" if hours > MOST_HOURS else ""
    print(f"{counted}{late}: " + (f"{len(missed)} missed" if missed else "all met"))
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
