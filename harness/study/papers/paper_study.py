"""A paper study: named runs in one folder, which are run by `harness.run`, resumed, and read back.

The folder has study.json (the identity of the study), a folder for each run, and measured/ for other measurements.
Its quick form has a few short clips, to see that everything works. It decides no statement.
"""

import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from harness.compare import Sampling, count_units
from harness.core.files import content_key, to_json_types
from harness.core.progress import ProgressCallback
from harness.errors import HarnessError, SystemFault, was_interrupted
from harness.experiment import cell_names
from harness.experiment import run as run_scenario
from harness.experiment.scenarios import Scenario
from harness.mocap import LibraryFolders
from harness.results import Cell, cell_folder, read_cell, read_summary, source_hash
from harness.results.files import check_key, read_result_json, write_result_json

CLIPS, LONGEST_S = 2, 3.0
"""Number of test clips of each behaviour, and their length with the first second [s]."""
DATABASE_SHARE = 0.05
"""Share of the paper's frames in the databases whose speed is measured."""


@dataclass(frozen=True)
class PaperStudy:
    """The results that experiments read."""

    out: Path
    motion: Literal["builtin", "cmu"]
    seed: int
    runs: Mapping[str, Scenario]
    """Name of a run and of its folder -> its scenario."""
    library: LibraryFolders | None = None
    """Folder of the motion library; None for synthetic motion."""
    failures: Mapping[str, str] = field(default_factory=dict)
    """"run: cell", or the name of a run that was refused as a whole -> traceback or message of its failure."""
    quick: bool = False
    """Whether this is the quick form (see `shorten_scenario`)."""

    def rows(self, run: str, **where: Any) -> list[dict[str, Any]]:
        """Rows of the summary for finished cells of a run; [] where nothing ran, or where the folder holds another run.

        `where` selects rows by columns of `summary.csv`, such as method, inputs, behaviour, performer and clip.
        A row also has the `unit` of its clip, and `unit_clips`: how many clips of that unit and behaviour were planned.
        """
        wanted, rows = to_json_types(where), self.summary_rows(run)
        if not rows:
            return []
        motion, sampling = self.runs[run].motion, Sampling(unit=self.runs[run].unit)
        planned = Counter((sampling.unit_of(clip), behaviour) for clip, behaviour in motion.tested)
        selected = (row for row in rows if all(row[name] == value for name, value in wanted.items()))
        units = ((row, sampling.unit_of(row["clip"])) for row in selected)
        return [{**row, "unit": unit, "unit_clips": planned[unit, row["behaviour"]]} for row, unit in units]

    def summary_rows(self, run: str) -> list[dict[str, Any]]:
        """All rows of the summary of a run, [] as in `rows`."""
        summary = self.out / run / "summary.json"
        if run not in self.runs or run in self.failures or not summary.is_file():
            return []
        return _summary_rows(summary.parent, summary.stat().st_mtime_ns)

    def cells(self, run: str, **where: Any) -> Iterator[tuple[dict[str, Any], Cell]]:
        """Rows selected as in `rows`, each with its cell: the errors of every frame and joint, read one at a time."""
        return ((row, read_cell(cell_folder(self.out / run, row["key"]))) for row in self.rows(run, **where))

    def counted_units(self, runs: Iterable[str]) -> str:
        """The units of the statistics of some runs in words, such as "boxing_inputs: 12 performers"."""
        counted = {
            name: count_units(map(Sampling(unit=run.unit).unit_of, run.motion.test))
            for name, run in self.runs.items()
            if name in runs
        }
        return "; ".join(f"{name}: {words}" for name, words in counted.items())

    def cached_measurement(self, name: str, measure: Callable[[], Any]) -> Any:
        """Result of `measure` in JSON types, cached on disk until the source of the package changes.

        BadFile for a cached result that is damaged, edited, or of another measurement or study.
        """
        path = self.out / "measured" / f"{name}.json"
        study = {run: scenario.content() for run, scenario in self.runs.items()}
        key = content_key({"measurement": name, "motion": self.motion, "seed": self.seed, "runs": study})
        written = {"key": key, "measurement": name, "source_hash": source_hash()}
        if path.is_file():
            expected, advice = "a cached measurement of this study", "Delete it and give the command again."
            cached = read_result_json(path, expected, advice)
            if cached.get("source_hash") == source_hash():
                for entry in ("measurement", "key"):
                    check_key(path, cached.get(entry), written[entry], expected, advice)
                return cached["value"]
        path.parent.mkdir(exist_ok=True)
        value = to_json_types(measure())
        write_result_json(path, {**written, "value": value})
        return value


@lru_cache(maxsize=16)
def _summary_rows(run: Path, written_ns: int) -> list[dict[str, Any]]:
    """Rows of a summary, cached by its time of writing, since experiments read it many times."""
    rows: list[dict[str, Any]] = read_summary(run)["cells"]
    return rows


def run_scenarios(
    runs: Mapping[str, Scenario],
    out: Path,
    *,
    folder: LibraryFolders | None = None,
    jobs: int = 1,
    command: str = "",
    progress: ProgressCallback = lambda cell, done, planned: None,
) -> dict[str, str]:
    """Run or resume each scenario in the folder of its name below `out`; returns "run: cell" -> failure.

    After a failed cell or a refused run, the others still run.
    """
    planned, before, failures = count_cells(runs), 0, dict[str, str]()
    for name, scenario in runs.items():

        def report(cell: str, done: int, _: int, name: str = name, before: int = before) -> None:
            progress(f"{name}: {cell}", before + done, planned)

        run_folder = out / name
        try:
            run_scenario(scenario, run_folder, folder=folder, jobs=jobs, command=command, progress=report)
        except (OSError, SystemFault):
            raise
        except HarnessError as error:
            failures[name] = str(error)
        except Exception as error:
            if was_interrupted(error):
                raise
            failures[name] = traceback.format_exc()
        if name not in failures:
            failed: Mapping[str, str] = read_summary(run_folder)["failures"]
            failures |= {f"{name}: {cell}": text for cell, text in failed.items()}
        before += count_cells({name: scenario})
    return failures


def count_cells(runs: Mapping[str, Scenario]) -> int:
    """Number of cells of all runs."""
    return sum(len(cell_names(scenario)) for scenario in runs.values())


def shorten_scenario(scenario: Scenario) -> Scenario:
    """The scenario with the first `CLIPS` test clips of each behaviour, of `LONGEST_S` at most; its database stays."""
    motion, taken, kept = scenario.motion, Counter[str](), list[tuple[str, str]]()
    for clip, behaviour in motion.tested:
        taken[behaviour] += 1
        if taken[behaviour] <= CLIPS:
            kept.append((clip, behaviour))
    test, behaviours = zip(*kept, strict=True)
    longest_s = min(motion.longest_s or LONGEST_S, LONGEST_S)
    return replace(scenario, motion=replace(motion, test=test, behaviours=behaviours, longest_s=longest_s))
