"""The whole loop: mocap -> body -> simulate -> calibrate -> reconstruct -> score -> report, clip by clip."""

from collections.abc import Iterator
from concurrent.futures import BrokenExecutor
from dataclasses import asdict
from pathlib import Path

from harness.core.split import ClipPart
from harness.core.workers import run_in_workers
from harness.errors import BadInput, Outcome
from harness.experiment.cells import (
    CellOutcome,
    ClipTask,
    ProgressCallback,
    check_names,
    clear_caches,
    open_scenario_motion,
    run_clip_task,
)
from harness.experiment.scenario import Scenario, expand_clips, variants
from harness.reconstruct import registry
from harness.results import manifest, storage
from harness.results.cell import varied_text
from harness.results.lock import folder_lock


def run(
    scenario: Scenario,
    out: Path,
    *,
    folder: Path | None = None,
    jobs: int = 1,
    command: str = "",
    progress: ProgressCallback = lambda cell, done, planned: None,
) -> Outcome:
    """Run what is not finished yet, and write summary.json and summary.csv of all of it.

    `out` is made, or resumed when it holds this very scenario, else refused (BadInput). A cell that fails is
    listed with its traceback and never stops the rest; when nothing but refusals came out, the first one is raised.
    NOT_COMPARABLE when every cell came below the floor of coverage, so that nothing was measured.
    Names that do not exist are refused before anything is written.
    """
    clear_caches()
    scenario = expand_clips(scenario, folder)
    parts = [ClipPart.parse(text) for text in scenario.motion.test]
    behaviours = scenario.motion.behaviours * (1 if len(scenario.motion.behaviours) > 1 else len(parts))
    todo = [ClipTask(scenario, part, b, folder, command) for part, b in zip(parts, behaviours, strict=True)]
    for _, made in reversed(variants(scenario)):
        source = open_scenario_motion(made.motion, folder, made.seed)
        check_names(made, source, parts)
    content = asdict(scenario)
    del content["fault"]  # of an emulator alone: a run is the same with and without
    constants = {name: repr(registry.resolve(name)) for name in scenario.methods}
    described = manifest.describe_run(content, motion_source=source.title, command=command, constants=constants)
    storage.open_run(out, described)
    planned = _cells_in_table_order(todo)
    ended: dict[str, CellOutcome] = {}
    with folder_lock(out, alone=False):
        try:
            for cell in _run_cells(todo, out, jobs):
                ended[cell.cell] = cell
                progress(cell.cell, len(ended), len(planned))
        finally:
            in_order = [ended[cell] for cell in planned if cell in ended]
            failed = {cell.cell: cell.failure for cell in in_order if cell.failure}
            keys = [cell.key for cell in in_order if not cell.failure]
            orders = scenario.expected_order
            summary = storage.write_summary(out, keys=keys, planned=len(planned), failures=failed, orders=orders)
    if failed and all(cell.refused for cell in in_order):
        raise BadInput(f"Nothing could be run. {next(iter(failed.values()))}", "")
    if failed:
        return Outcome.INCOMPLETE
    measured = any(row["joint_angle_mean_deg"] is not None for row in summary["cells"])
    return Outcome.PASS if measured else Outcome.NOT_COMPARABLE


def _cells_in_table_order(todo: list[ClipTask]) -> list[str]:
    """Every cell as tables list them: the varied values change slowest, then the clips."""
    cells = [cell for job in todo for cell in job.cells()]
    places = {varied_text(varied): place for place, (varied, _) in enumerate(variants(todo[0].scenario))}
    return [str(cell) for cell in sorted(cells, key=lambda cell: places[varied_text(cell.varied)])]


def _run_cells(todo: list[ClipTask], out: Path, jobs: int) -> Iterator[CellOutcome]:
    if min(jobs, len(todo)) <= 1:
        for job in todo:
            yield from run_clip_task(job, out)
        return
    for which, done in run_in_workers(_run_whole_task, [(job, out) for job in todo], min(jobs, len(todo))):
        try:
            yield from done.result()
        except BrokenExecutor:
            yield from (CellOutcome(str(cell), failure="a worker process died") for cell in todo[which].cells())


def _run_whole_task(job: ClipTask, out: Path) -> list[CellOutcome]:
    return list(run_clip_task(job, out))
