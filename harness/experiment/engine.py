"""The whole loop: mocap -> body -> simulate -> calibrate -> reconstruct -> score -> report, clip by clip."""

from collections.abc import Iterator
from concurrent.futures import BrokenExecutor
from dataclasses import asdict
from pathlib import Path

from harness.core.split import Part
from harness.core.workers import call_each
from harness.errors import BadInput, Outcome
from harness.experiment.cells import Ended, Job, Progress, check_names, forget_motion, run_job, source_of
from harness.experiment.scenario import Scenario, variants
from harness.reconstruct import registry
from harness.results import manifest, storage
from harness.results.cell import varied_text
from harness.results.lock import at_work


def run(
    scenario: Scenario,
    out: Path,
    *,
    folder: Path | None = None,
    jobs: int = 1,
    command: str = "",
    progress: Progress = lambda cell, done, planned: None,
) -> Outcome:
    """Run what is not finished yet, and write summary.json and summary.csv of all of it.

    `out` is made, or resumed when it holds this very scenario, else refused (BadInput). A cell that fails is
    listed with its traceback and never stops the rest; when nothing but refusals came out, the first one is raised.
    NOT_COMPARABLE when every cell came below the floor of coverage, so that nothing was measured.
    Names that do not exist are refused before anything is written.
    """
    forget_motion()
    parts = [Part.parse(text) for text in scenario.motion.test]
    behaviours = scenario.motion.behaviours * (1 if len(scenario.motion.behaviours) > 1 else len(parts))
    todo = [Job(scenario, part, b, folder, command) for part, b in zip(parts, behaviours, strict=True)]
    for _, made in reversed(variants(scenario)):
        source = source_of(made.motion, folder, made.seed)
        check_names(made, source, parts)
    content = asdict(scenario)
    del content["fault"]  # of an emulator alone: a run is the same with and without
    constants = {name: repr(registry.resolve(name)) for name in scenario.methods}
    described = manifest.of_run(content, motion_source=source.title, command=command, constants=constants)
    storage.open_run(out, described)
    planned = _in_order(todo)
    ended: dict[str, Ended] = {}
    with at_work(out, alone=False):
        try:
            for cell in _cells(todo, out, jobs):
                ended[cell.cell] = cell
                progress(cell.cell, len(ended), len(planned))
        finally:
            in_order = [ended[cell] for cell in planned if cell in ended]
            failed = {cell.cell: cell.failure for cell in in_order if cell.failure}
            keys = [cell.key for cell in in_order if not cell.failure]
            orders = scenario.order
            summary = storage.write_summary(out, keys=keys, planned=len(planned), failures=failed, orders=orders)
    if failed and all(cell.refused for cell in in_order):
        raise BadInput(f"Nothing could be run. {next(iter(failed.values()))}", "")
    if failed:
        return Outcome.INCOMPLETE
    measured = any(row["joint_angle_mean_deg"] is not None for row in summary["cells"])
    return Outcome.PASS if measured else Outcome.NOT_COMPARABLE


def _in_order(todo: list[Job]) -> list[str]:
    """Every cell as tables list them: the varied values change slowest, then the clips."""
    cells = [cell for job in todo for cell in job.cells()]
    places = {varied_text(varied): place for place, (varied, _) in enumerate(variants(todo[0].scenario))}
    return [str(cell) for cell in sorted(cells, key=lambda cell: places[varied_text(cell.varied)])]


def _cells(todo: list[Job], out: Path, jobs: int) -> Iterator[Ended]:
    if min(jobs, len(todo)) <= 1:
        for job in todo:
            yield from run_job(job, out)
        return
    for which, done in call_each(_run_whole_job, [(job, out) for job in todo], min(jobs, len(todo))):
        try:
            yield from done.result()
        except BrokenExecutor:
            yield from (Ended(str(cell), failure="a worker process died") for cell in todo[which].cells())


def _run_whole_job(job: Job, out: Path) -> list[Ended]:
    return list(run_job(job, out))
