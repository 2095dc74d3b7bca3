"""Reproduction of a paper: its runs, then its experiments in turn, then findings.json."""

import traceback
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from itertools import chain, islice
from pathlib import Path
from typing import Any, Literal

from harness.compare import Sampling, count_units
from harness.core.object_state import describe_state
from harness.core.package_data import data_folder
from harness.core.progress import ProgressCallback
from harness.core.split import ClipPart, allowed_frames
from harness.errors import BadInput, Outcome, SystemFault, UnknownName, was_interrupted
from harness.experiment import check_names
from harness.experiment.scenarios import Scenario, load_scenario, open_scenario_motion
from harness.mocap import LibraryFolders
from harness.reconstruct import make_method
from harness.results import current_circumstances, open_study, varied_text
from harness.results.findings import FindingsTable, PaperExperiment, PaperFindings, write_findings
from harness.study.papers.claims import correct_claims
from harness.study.papers.paper_study import PaperStudy, count_cells, run_scenarios, shorten_scenario

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
    runs_of: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Experiment -> the runs that it reads; one that is not listed reads all."""

    def plan(self, motion: Motion, seed: int) -> dict[str, Scenario]:
        """Name of a run -> its scenario, from the files for this motion."""
        folder = data_folder("scenarios") / "papers" / self.name
        files = sorted(folder.glob(f"{motion}_*.toml"))
        scenarios = {path.stem.removeprefix(f"{motion}_"): load_scenario(path) for path in files}
        return {name: replace(scenario, name=name, seed=seed) for name, scenario in scenarios.items()}

    def only(self, experiments: Collection[str]) -> "Paper":
        """The paper with these experiments alone; UnknownName."""
        for name in experiments:
            if name not in self.experiments:
                raise UnknownName(f"experiment of {self.name}", name, self.experiments)
        return replace(
            self, experiments={name: self.experiments[name] for name in self.experiments if name in experiments}
        )

    def needs(self, run: str) -> bool:
        """Whether one of the experiments reads this run."""
        return any(run in self.runs_of.get(name, (run,)) for name in self.experiments)


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
    quick: bool = False,
    command: str = "",
    progress: ProgressCallback = lambda last, done, planned: None,
) -> tuple[PaperFindings, Outcome]:
    """Run what is not finished, evaluate the experiments, and write findings.json into `out`.

    The motion is synthetic, or that of `library`. `quick` runs the form of `shorten_scenario`, which decides nothing.
    `out` is created, or resumed when it holds the same study, else refused (BadInput). Its lock is held meanwhile.
    The outcome is INCOMPLETE when a cell or an experiment failed, else PASS: a claim that is not reproduced is a
    result.
    """
    motion: Motion = "cmu" if library else "builtin"
    plan = {name: shorten_scenario(run) if quick else run for name, run in paper.plan(motion, seed).items()}
    if not plan:
        raise BadInput(f"{paper.name} has no runs on {motion} motion.", "Choose the other motion.")
    runs = {name: run for name, run in plan.items() if paper.needs(name)}
    check_names(runs.values(), library)
    source = open_scenario_motion(next(iter(plan.values())).motion, library, seed)
    title = source.title + (", quick form" if quick else "")
    with open_study(out, {"paper": paper.name, "motion": title, "seed": seed}):
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
        study = PaperStudy(out, motion, seed, plan, library, failures, quick)
        experiments, failed = [], False
        for done, (name, evaluate) in enumerate(paper.experiments.items()):
            progress(name, cells + done, planned)
            try:
                experiments.append(_with_notes(evaluate(study), study))
            except (OSError, SystemFault):
                raise
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
            experiments=correct_experiments(experiments),
            circumstances=current_circumstances(),
            tables=provenance_tables(replace(study, runs=runs)),
        )
        write_findings(out / "findings.json", findings)
        return findings, Outcome.INCOMPLETE if failures or failed else Outcome.PASS


def correct_experiments(experiments: Sequence[PaperExperiment]) -> tuple[PaperExperiment, ...]:
    """Apply Holm's correction over the printed statements of all experiments (see `claims.correct_claims`)."""
    claims = iter(correct_claims([claim for experiment in experiments for claim in experiment.claims]))
    return tuple(replace(each, claims=tuple(islice(claims, len(each.claims)))) for each in experiments)


def _with_notes(experiment: PaperExperiment, study: PaperStudy) -> PaperExperiment:
    """Add notes on the units of the runs that an experiment uses, and on each of their failed cells."""
    units = [f"Units of the statistics: {counted}."] if (counted := study.counted_units(experiment.runs)) else []
    failed = [
        f"FAILED {cell}: {text.strip().splitlines()[-1]}"
        for cell, text in study.failures.items()
        if cell.partition(":")[0] in experiment.runs
    ]
    return replace(experiment, notes=(*experiment.notes, *units, *failed))


TUNING_SCENARIOS = "scenarios/tune_*.toml and validate_*.toml, on the real test clips that they list"


def provenance_tables(study: PaperStudy) -> tuple[FindingsTable, ...]:
    """Tables of the provenance of a study."""
    return (
        FindingsTable(
            "Runs", ("run", "setting", "methods", "inputs", "varied"), tuple(map(_run_row, study.runs.values()))
        ),
        FindingsTable(
            "Test clips and examples",
            (
                "run",
                "behaviour",
                "test clips",
                "units",
                "examples (without the test clip)",
                "frames of examples, at most",
            ),
            tuple(chain.from_iterable(_database_rows(study, scenario) for scenario in study.runs.values())),
        ),
        FindingsTable(
            "Left out", ("run", "what", "why"), tuple(chain.from_iterable(map(_left_out_rows, study.runs.values())))
        ),
        FindingsTable(
            f"Constants of the methods (chosen by {TUNING_SCENARIOS})",
            ("method", "constants"),
            _method_constants(study),
        ),
    )


def _run_row(scenario: Scenario) -> tuple[str, ...]:
    motion = scenario.motion
    setting = (
        f"{motion.source}, split {motion.split}, body {motion.body}, calibration {scenario.calibration}, "
        f"noise {scenario.noise}, {scenario.tracker.rate_hz:g} Hz, seed {scenario.seed}, "
        f"stations {', '.join(scenario.worn_stations)}"
    )
    vary = [f"{key}: {', '.join(_value_text(key, value) for value in values)}" for key, values in scenario.vary.items()]
    methods, inputs = ", ".join(scenario.methods), ", ".join(scenario.inputs)
    return scenario.name, setting, methods, inputs, "; ".join(vary) or "nothing"


def _value_text(key: str, value: Any) -> str:
    """The text of a value without its key."""
    return varied_text({key: value}).removeprefix(f"{key}=")


def _database_rows(study: PaperStudy, scenario: Scenario) -> Iterator[tuple[str, ...]]:
    motion = scenario.motion
    source = open_scenario_motion(motion, study.library, scenario.seed)
    for behaviour in dict.fromkeys(what for _, what in motion.tested):
        tested = [clip for clip, what in motion.tested if what == behaviour]
        same_behaviour = motion.database == "behaviour"
        examples = [name for name in motion.examples if not same_behaviour or source.behaviour(name) == behaviour]
        frames = (round(_example_duration_s(study, scenario, name) * scenario.tracker.rate_hz) for name in examples)
        count = motion.thin_to or round(motion.example_share * sum(frames))
        units = count_units(map(Sampling(unit=scenario.unit).unit_of, tested))
        yield (
            scenario.name,
            behaviour,
            ", ".join(tested),
            units,
            f"{len(examples)}: {', '.join(examples)}",
            f"{count:,}",
        )


def _example_duration_s(study: PaperStudy, scenario: Scenario, name: str) -> float:
    """Duration of an example without its withheld parts [s]."""
    clip = open_scenario_motion(scenario.motion, study.library, scenario.seed).load(ClipPart.parse(name).clip)
    withheld = map(ClipPart.parse, scenario.motion.withheld)
    return sum(map(len, allowed_frames(withheld, clip.name, len(clip), clip.rate_hz))) / clip.rate_hz


def _left_out_rows(scenario: Scenario) -> list[tuple[str, ...]]:
    return [(scenario.name, what, why) for what, why in scenario.left_out.items()]


def _method_constants(study: PaperStudy) -> tuple[tuple[str, ...], ...]:
    names: Sequence[str] = list(dict.fromkeys(chain.from_iterable(s.methods for s in study.runs.values())))
    return tuple((name, describe_state(make_method(name), name)) for name in names)
