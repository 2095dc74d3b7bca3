"""A study: named runs in one folder, made by `engine.run`, resumed where they were, and read back.

The folder holds study.json, which says whose it is, a folder for each run, and measured/ for what no run measures.
"""

import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from harness.core.files import read_json, to_json_types, write_json
from harness.errors import HarnessError, was_interrupted
from harness.experiment import engine
from harness.experiment.cells import ProgressCallback
from harness.experiment.scenario import Scenario, variants
from harness.results import manifest
from harness.results.cell import Cell, cell_folder, read_cell
from harness.results.storage import open_folder, read_summary

_IDENTITY_FILE = "study.json"


@dataclass(frozen=True)
class PaperStudy:
    """What an experiment reads its results from."""

    out: Path
    motion: Literal["builtin", "cmu"]
    seed: int
    runs: Mapping[str, Scenario]
    """Name -> what ran in the folder of that name."""
    library: Path | None = None
    """The folder of real motion."""
    failures: Mapping[str, str] = field(default_factory=dict)
    """"run: cell" -> what went wrong there."""

    def rows(self, run: str, **where: Any) -> list[dict[str, Any]]:
        """The run's finished cells, as rows of its summary, whose columns are as `where` says; [] where nothing ran.

        Columns are those of `summary.csv`, such as method, inputs, behaviour, performer, clip and varied.
        """
        summary, wanted = self.out / run / "summary.json", to_json_types(where)
        if run not in self.runs or not summary.is_file():
            return []
        rows = _summary_rows(summary.parent, summary.stat().st_mtime_ns)
        return [row for row in rows if all(row[name] == value for name, value in wanted.items())]

    def cells(self, run: str, **where: Any) -> Iterator[Cell]:
        """The same as whole cells, with the errors of every frame and joint, one at a time."""
        return (read_cell(cell_folder(self.out / run, row["key"])) for row in self.rows(run, **where))

    def cached_measurement(self, name: str, measure: Callable[[], Any]) -> Any:
        """What `measure` gave, in JSON's types: it is asked once, and again when the package's source has changed."""
        path = self.out / "measured" / f"{name}.json"
        if path.is_file():
            found = read_json(path, "what a study measured")
            if found.get("source_hash") == manifest.source_hash() and "value" in found:
                return found["value"]
        path.parent.mkdir(exist_ok=True)
        write_json(path, {"value": measure(), "source_hash": manifest.source_hash()})
        return read_json(path, "what a study measured")["value"]


@lru_cache(maxsize=16)
def _summary_rows(run: Path, written_ns: int) -> list[dict[str, Any]]:
    """Of a summary as it was written then; experiments ask for it again and again."""
    rows: list[dict[str, Any]] = read_summary(run)["cells"]
    return rows


def open_study(out: Path, identity: Mapping[str, Any]) -> None:
    """Create a study's folder, or open it to resume; BadInput when it holds another study or other files."""

    def difference(path: Path) -> str:
        stored, given = read_json(path, "the identity of a study"), to_json_types(identity)
        return "; ".join(f"{k}: {stored.get(k)}, not {given[k]}" for k in given if stored.get(k) != given[k])

    open_folder(out, _IDENTITY_FILE, identity, "study", difference)


def run_scenarios(
    runs: Mapping[str, Scenario],
    out: Path,
    *,
    folder: Path | None = None,
    jobs: int = 1,
    command: str = "",
    progress: ProgressCallback = lambda cell, done, planned: None,
) -> dict[str, str]:
    """Run each scenario into the folder of its name below `out`; what is finished is kept. "run: cell" -> failure.

    A cell that fails stops no other, a run that is refused no other run.
    """
    planned, before, failures = count_cells(runs), 0, dict[str, str]()
    for name, scenario in runs.items():

        def told(cell: str, done: int, _: int, name: str = name, before: int = before) -> None:
            progress(f"{name}: {cell}", before + done, planned)

        place = out / name
        try:
            engine.run(scenario, place, folder=folder, jobs=jobs, command=command, progress=told)
        except HarnessError as error:
            failures[name] = str(error)
        except Exception as error:
            if was_interrupted(error):
                raise
            failures[name] = traceback.format_exc()
        if name not in failures:
            failed: Mapping[str, str] = read_summary(place)["failures"]
            failures |= {f"{name}: {cell}": text for cell, text in failed.items()}
        before += count_cells({name: scenario})
    return failures


def count_cells(runs: Mapping[str, Scenario]) -> int:
    """How many cells all runs have."""
    return sum(
        len(made.motion.test) * len(made.methods) * len(made.inputs)
        for scenario in runs.values()
        for _, made in variants(scenario)
    )
