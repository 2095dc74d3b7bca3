"""The store of a run: it keeps the outcome of each cell in the index of the run's folder, and ends with the summary."""

import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from harness.compare.run_summary import compute_run_statistics
from harness.core.fault_report import named_folder_fault
from harness.core.files import TEMPORARY
from harness.core.progress import ProgressCallback
from harness.errors import BadInput, Outcome
from harness.experiment.cells import CellOutcome
from harness.experiment.plan import CellPlan, RunPlan
from harness.experiment.workers.cell_watcher import ProgressCount, graceful_stop
from harness.results import CellIndex, open_run, remove_leftovers, write_summary


@dataclass
class CellStore:
    """Outcomes of cells in the folder `out`, whose lock the caller holds."""

    out: Path
    plan: CellPlan
    index: CellIndex
    progress: ProgressCallback
    outcomes: dict[str, CellOutcome] = field(default_factory=dict)
    """Cell -> its outcome, without the row, which is in the index."""
    _made: int = 0

    def __post_init__(self) -> None:
        (self.out / "cells").mkdir(exist_ok=True)
        self._count = ProgressCount(self.out, lambda last, ended: self.progress(last, ended, len(self.plan.names)))

    @property
    def stop(self) -> Path:
        """The file that asks workers to stop."""
        return self.out / f"{TEMPORARY}{os.getpid()}-stop"

    @contextmanager
    def recording(self, *, watched: bool) -> Iterator[None]:
        """Record cells while they are evaluated; with `watched` those that workers have written are counted as well.

        The first Ctrl-C makes the file `stop`, see `graceful_stop`.
        """
        remove_leftovers(self.out)
        index, names, sources = self.index, self.plan.names, self.plan.sources
        index.expect(names)
        # While the code is the same, cells of the last time count as finished before they are looked at again.
        same, failed = index.facts().get("sources") == sources, index.failures()
        index.reset([name for name in names if name in failed] if same else names)
        index.note(sources=sources, started_s=time.time(), made=0)
        self.progress("", 0, len(names))  # a bar is there while the first cells compile
        try:
            with graceful_stop(self.stop):
                if watched:
                    with self._count.watching():
                        yield
                else:
                    yield
        finally:
            remove_leftovers(self.out)  # of workers that were stopped at once

    def record(self, outcome: CellOutcome) -> None:
        """Put the outcome of one cell into the index."""
        if outcome.row is not None:
            self.index.add([outcome.row], [outcome.seconds or None])
        self.index.record_outcomes([(outcome.cell, outcome.key, outcome.failure)])
        self._made += outcome.seconds > 0.0
        self.index.note(made=self._made, seen_s=time.time())
        self.outcomes[outcome.cell] = replace(outcome, row=None)
        self._count.add(outcome.cell, outcome.key)

    def results(self) -> tuple[tuple[Mapping[str, Any], ...], dict[str, str]]:
        """Rows of the finished cells in planned order, and the failures of the others."""
        ended = [self.outcomes[name] for name in self.plan.names if name in self.outcomes]
        rows = self.index.rows_of([outcome.key for outcome in ended if not outcome.failure])
        return tuple(rows), {outcome.cell: outcome.failure for outcome in ended if outcome.failure}


@dataclass
class RunFolder:
    """The folder of a plan: created, or resumed if it holds this plan, else refused (BadInput)."""

    plan: RunPlan
    out: Path
    progress: ProgressCallback
    outcome: Outcome = Outcome.INCOMPLETE
    """The outcome of the run, once the folder is closed."""

    @contextmanager
    def opened(self) -> Iterator[CellStore]:
        """The store of its cells. The summary is written when it closes, also after an interrupt.

        If every cell is refused, the first refusal is raised (BadInput).
        """
        plan, out = self.plan, self.out
        with open_run(out, plan.manifest), named_folder_fault(out), CellIndex(out) as index:
            index.add_from_folders()
            index.plan(plan.names)
            index.note(kind=plan.kind, name=plan.name, command=plan.command)
            store = CellStore(out, plan.cells, index, self.progress)
            try:
                yield store
            finally:
                summary = self._write_summary(index)
            outcomes = store.outcomes.values()
            if outcomes and all(cell.refused for cell in outcomes):
                raise BadInput(f"Nothing could be run. {next(iter(outcomes)).failure}", "")
            self.outcome = next(outcome for outcome in Outcome if outcome.word == summary["outcome"])

    def _write_summary(self, index: CellIndex) -> Mapping[str, Any]:
        plan, manifest = self.plan, self.plan.manifest
        orders = plan.scenarios[0].expected_order
        return write_summary(
            index,
            self.out,
            compute_run_statistics(index, self.out, orders, manifest.training_data) if plan.kind == "run" else {},
            kind=plan.kind,
            name=plan.name,
            command=plan.command,
            performers=manifest.performers,
            unit=manifest.unit,
            scenarios=[scenario.label for scenario in plan.scenarios],
            vary={key: values for scenario in plan.scenarios for key, values in scenario.varied_keys.items()},
        )
