"""Reproduction of a paper: its runs, then its experiments in turn, then findings.json."""

import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Literal

from harness.core.package_data import data_folder
from harness.errors import BadInput, Outcome, UnknownName, was_interrupted
from harness.experiment.cells import ProgressCallback, check_names, open_scenario_motion
from harness.experiment.scenario import Scenario, load_scenario
from harness.mocap.library import LibraryFolders
from harness.results import manifest
from harness.results.findings import PaperExperiment, PaperFindings, write_findings
from harness.study.papers.paper_study import PaperStudy, count_cells, open_study, run_scenarios
from harness.study.papers.provenance import provenance_tables

PAPERS = ("liu2011", "kim2012")
"""Names of modules of this folder, each with a `PAPER`."""
Motion = Literal["builtin", "cmu"]


@dataclass(frozen=True)
class Paper:
    """One paper and its experiments."""

    name: str
    reference: str
    """Authors, title, venue, year."""
    experiments: Mapping[str, Callable[[PaperStudy], PaperExperiment]]
    """Name -> experiment, in the order of the report."""

    def plan(self, motion: Motion, seed: int) -> dict[str, Scenario]:
        """Name of a run -> its scenario, from the files for this motion."""
        folder = data_folder("scenarios") / "papers" / self.name
        files = sorted(folder.glob(f"{motion}_*.toml"))
        scenarios = {path.stem.removeprefix(f"{motion}_"): load_scenario(path) for path in files}
        return {name: replace(scenario, name=name, seed=seed) for name, scenario in scenarios.items()}


def load_paper(name: str) -> Paper:
    """Load a paper by name; UnknownName."""
    if name not in PAPERS:
        raise UnknownName("paper", name, PAPERS)
    paper: Paper = import_module(f"harness.study.papers.{name}").PAPER
    return paper


def reproduce(
    paper: Paper,
    out: Path,
    *,
    library: LibraryFolders | None = None,
    seed: int = 1,
    jobs: int = 1,
    command: str = "",
    progress: ProgressCallback = lambda last, done, planned: None,
) -> tuple[PaperFindings, Outcome]:
    """Run what is not finished, evaluate the experiments, and write findings.json into `out`.

    The motion is synthetic, or that of `library`. `out` is created, or resumed when it holds the same study, else
    refused (BadInput). The outcome is INCOMPLETE when a cell or an experiment failed, else PASS: a claim that is not
    reproduced is a result.
    """
    motion: Motion = "cmu" if library else "builtin"
    runs = paper.plan(motion, seed)
    if not runs:
        raise BadInput(f"{paper.name} has no runs on {motion} motion.", "Choose the other motion.")
    check_names(runs.values(), library)
    title = open_scenario_motion(next(iter(runs.values())).motion, library, seed).title
    open_study(out, {"paper": paper.name, "motion": title, "seed": seed})
    cells = count_cells(runs)
    planned = cells + len(paper.experiments)
    failures = run_scenarios(
        runs,
        out,
        folder=library,
        jobs=jobs,
        command=command,
        progress=lambda last, done, _: progress(last, done, planned),
    )
    study = PaperStudy(out, motion, seed, runs, library, failures)
    experiments, failed = [], False
    for done, (name, evaluate) in enumerate(paper.experiments.items()):
        progress(name, cells + done, planned)
        try:
            experiments.append(_with_failures(evaluate(study), study))
        except Exception as error:  # the other experiments are still evaluated
            if was_interrupted(error):
                raise
            failed = True
            last = traceback.format_exc().strip().splitlines()[-1]
            experiments.append(PaperExperiment(name, name, "", (), notes=(f"This experiment failed: {last}",)))
    progress("findings", planned, planned)
    findings = PaperFindings(
        paper=paper.name,
        reference=paper.reference,
        motion=title,
        command=command,
        seed=seed,
        experiments=tuple(experiments),
        circumstances=manifest.current_circumstances(),
        tables=provenance_tables(study),
    )
    write_findings(out / "findings.json", findings)
    return findings, Outcome.INCOMPLETE if failures or failed else Outcome.PASS


def _with_failures(experiment: PaperExperiment, study: PaperStudy) -> PaperExperiment:
    """Add a note for each failed cell of the runs that an experiment uses."""
    failed = [
        f"FAILED {cell}: {text.strip().splitlines()[-1]}"
        for cell, text in study.failures.items()
        if cell.partition(":")[0] in experiment.runs
    ]
    return replace(experiment, notes=(*experiment.notes, *failed))
