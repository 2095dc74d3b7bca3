"""A paper, rerun: its runs, then its experiments one by one, and findings.json of them all."""

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
from harness.results import manifest
from harness.results.findings import PaperExperiment, PaperFindings, write_findings
from harness.study.papers.paper_study import PaperStudy, count_cells, open_study, run_scenarios
from harness.study.papers.provenance import provenance_tables

PAPERS = ("liu2011", "kim2012")
"""Each a module of this folder with a `PAPER`."""
Motion = Literal["builtin", "cmu"]


@dataclass(frozen=True)
class Paper:
    """One paper and how its experiments are judged."""

    name: str
    reference: str
    """Authors, title, venue, year."""
    experiments: Mapping[str, Callable[[PaperStudy], PaperExperiment]]
    """In the order in which they are told."""

    def plan(self, motion: Motion, seed: int) -> dict[str, Scenario]:
        """Run -> scenario, from the files of that motion."""
        folder = data_folder("scenarios") / "papers" / self.name
        files = sorted(folder.glob(f"{motion}_*.toml"))
        found = {path.stem.removeprefix(f"{motion}_"): load_scenario(path) for path in files}
        return {name: replace(scenario, name=name, seed=seed) for name, scenario in found.items()}


def load_paper(name: str) -> Paper:
    """The paper of that name; UnknownName."""
    if name not in PAPERS:
        raise UnknownName("paper", name, PAPERS)
    found: Paper = import_module(f"harness.study.papers.{name}").PAPER
    return found


def reproduce(
    paper: Paper,
    out: Path,
    *,
    library: Path | None = None,
    seed: int = 1,
    jobs: int = 1,
    command: str = "",
    progress: ProgressCallback = lambda last, done, planned: None,
) -> tuple[PaperFindings, Outcome]:
    """Run what is not finished yet, judge, and write findings.json into `out`.

    On the built-in performer, or on the real motion in `library`. `out` is made, or resumed when it holds this very
    study, else refused (BadInput). INCOMPLETE when a cell or a whole experiment failed; what is not reproduced is a
    result like any other.
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
    experiments, broken = [], False
    for done, (name, ask) in enumerate(paper.experiments.items()):
        progress(name, cells + done, planned)
        try:
            experiments.append(_with_failures(ask(study), study))
        except Exception as error:  # one experiment that cannot be judged leaves the others as they are
            if was_interrupted(error):
                raise
            broken = True
            last = traceback.format_exc().strip().splitlines()[-1]
            experiments.append(
                PaperExperiment(name, name, "", (), notes=(f"This experiment could not be judged: {last}",))
            )
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
    return findings, Outcome.INCOMPLETE if failures or broken else Outcome.PASS


def _with_failures(experiment: PaperExperiment, study: PaperStudy) -> PaperExperiment:
    """With a note for each failure of the runs that it rests on."""
    failed = [
        f"FAILED {cell}: {text.strip().splitlines()[-1]}"
        for cell, text in study.failures.items()
        if cell.partition(":")[0] in experiment.runs
    ]
    return replace(experiment, notes=(*experiment.notes, *failed))
