"""A placement study: candidate places are measured in sets and ranked, and the chosen sets are tested."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from harness.core.progress import ProgressCallback
from harness.errors import Outcome
from harness.experiment import check_names, clear_caches
from harness.experiment.workers import TaskExecutor, run_in_process
from harness.mocap import LibraryFolders
from harness.results import open_study
from harness.results.files import FINDINGS
from harness.results.findings import PlacementFindings, StatisticalPower, write_placement
from harness.study.placement.file_run import FileRun
from harness.study.placement.plan import plan_placement, plan_study
from harness.study.placement.question import PlacementQuestion, question_study
from harness.study.placement.question_run import QuestionRun
from harness.study.placement.set_results import SetResults

Announce = Callable[[StatisticalPower | str], None]
"""Receives what a study can show before its cells run, and lines about the search of a question."""


def run_placement(
    asked: Path | str | PlacementQuestion,
    out: Path,
    *,
    folder: LibraryFolders | None = None,
    executor: TaskExecutor = run_in_process,
    jobs: int = 1,
    command: str = "",
    progress: ProgressCallback = lambda last, done, planned: None,
    announce: Announce = lambda news: None,
) -> tuple[PlacementFindings, Outcome]:
    """Run the study in a TOML file, or the one that answers a question, and write findings.json into `out`.

    Without `folder` a question's motion is built in, else the library's. The first sets of a file's study are measured
    as a pilot; `announce` is told what the study can show, and how long it will take with `jobs` workers, before the
    other cells run. The sets of a question are searched by halves (see `question_run`).

    `out` is created, or resumed when it holds this study, else refused (BadInput). Its lock is held meanwhile. Modes
    and claims are not part of the identity of a study: they may change while its cells are kept. The outcome is
    INCOMPLETE when a cell failed, NOT_COMPARABLE when nothing was measured, or not every set because of its line, else
    PASS: a claim that is not reproduced is a result.
    """
    clear_caches()  # files may have changed since the last run
    question = None
    if isinstance(asked, PlacementQuestion):
        question = question_study(asked, folder)
        scenario = question.scenario
        plan = plan_study(question.study, lambda name: scenario, folder)
        check_names([replace(plan.scenario, methods=(asked.second,))] if asked.second else [], folder)
    else:
        plan = plan_placement(asked, folder)
    cache = SetResults(out, folder, executor, command, progress, plan.study.link)
    identity = {"placement": plan.study.name, "motion": plan.motion, "seed": plan.scenario.seed}
    with open_study(cache.out, identity):
        (cache.out / "cells").mkdir(exist_ok=True)
        if question:
            findings = QuestionRun(plan, cache, question, announce).findings()
        else:
            findings = FileRun(plan, cache).findings(jobs, announce)
        write_placement(cache.out / FINDINGS, findings)
    if findings.failures:
        return findings, Outcome.INCOMPLETE
    return findings, Outcome.PASS if findings.best and not cache.line_loss else Outcome.NOT_COMPARABLE
