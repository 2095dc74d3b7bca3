"""Cost of sweeps: overhead for each cell, gain of a second worker, and time to read 100,000 cells.

Sweeps run by the command line in processes of their own. For comparison the same cells are evaluated one after another
in this process, without writing results. The 100,000 cells are fabricated: the index has rows of a small real sweep,
each with a folder of links to the files of a real cell.
"""

import csv
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.bench.cpu_time import hold_cpu_to_limit, overbooked, process_times
from harness.bench.limits import hold_to_limit
from harness.core.arrays import Floats
from harness.core.child_process import run_python
from harness.core.split import ClipPart
from harness.experiment import ClipEvaluation, ClipTask, evaluate_cell
from harness.experiment.scenarios import Scenario, load_scenario, open_scenario_motion
from harness.reconstruct import make_method
from harness.results import TIME_COLUMNS, CellIndex, compute_group_statistics, write_table
from harness.results.findings import BenchmarkStatement

MANY_CELLS = 100_000
SMALL_SWEEP, TINY_SWEEP = 200, 20
"""Cells of the two sweeps whose difference gives the overhead; both write a report page."""
MAX_OVERHEAD_UNITS, MAX_FOLDER_UNITS = 0.07, 70.0
"""Most CPU time of a cell beside its evaluation, and of a look at the large folder (see `cpu_time`)."""
MIN_GAIN = 1.8
"""Least speed-up by a second job."""
REPEATS = 3
"""Number of repeats; the shortest time counts, since other load only adds to it."""
CLIPS = ("walking_p1_01", "boxing_p11_01", "jumping_p14_01", "golf_p16_01")
PARALLEL_SWEEP = f"""
schema = 1
scenarios = ["demo"]
clips = {json.dumps(CLIPS)}
methods = ["ik", "local_pca", "dynamic_map"]

[vary]
components.echo.share = {[0.01 * n for n in range(16)]}
"""
"""The sweep for one and two workers: two minutes for one, so that start-up and report page hardly count."""


def bench_sweep(seed: int = 1, *, cells: int = SMALL_SWEEP, many: int = MANY_CELLS) -> list[BenchmarkStatement]:
    """Measure overhead, parallel speed-up and the reading of large folders."""
    with tempfile.TemporaryDirectory(prefix="harness-sweep-") as folder:
        return [
            *_overhead_rows(Path(folder), seed, cells),
            *_parallel_rows(Path(folder), seed),
            *_large_folder_rows(Path(folder), many),
        ]


def _overhead_rows(folder: Path, seed: int, cells: int) -> list[BenchmarkStatement]:
    """Overhead of a cell: difference of a large and a small sweep, minus the evaluation itself."""
    small, large = _write_sweep(folder, TINY_SWEEP), _write_sweep(folder, cells)
    scenario = replace(_small_scenario(cells), seed=seed)
    times: dict[str, list[Floats]] = {"few": [], "again": [], "all": [], "evaluated": []}
    for repeat in range(REPEATS):
        times["few"].append(_time_sweep(small, folder / f"few-{repeat}", seed))
        times["again"].append(_time_sweep(small, folder / f"few-{repeat}", seed))
        times["all"].append(_time_sweep(large, folder / f"all-{repeat}", seed))
        times["evaluated"].append(_time_scoring(scenario) / (cells - 1))
    shortest = {name: np.min(repeats, axis=0) for name, repeats in times.items()}
    extra = cells - TINY_SWEEP
    each_ms = 1e3 * ((shortest["all"] - shortest["few"]) / extra - shortest["evaluated"])
    again_ms = 1e3 * (_time_sweep(large, folder / "all-0", seed) - shortest["again"]) / extra
    evaluated_ms, (few_s, _) = 1e3 * shortest["evaluated"][0], shortest["few"]
    reference = f"{evaluated_ms:.0f} ms to evaluate a cell, {few_s:.1f} s for {TINY_SWEEP} cells"
    name = "overhead of a sweep, for each cell"
    return [
        hold_to_limit(name, float(each_ms[0]), "ms", reference=reference),
        hold_cpu_to_limit(name, 1e-3 * float(each_ms[1]), MAX_OVERHEAD_UNITS),
        hold_to_limit("resuming a sweep, for each finished cell", float(again_ms[0]), "ms", reference=f"{cells} cells"),
    ]


def _write_sweep(folder: Path, cells: int) -> Path:
    path = folder / f"cells-{cells}.toml"
    shares = json.dumps(_shares(cells))
    path.write_text(
        f'schema = 1\nscenarios = ["demo"]\nclips = ["{CLIPS[0]}"]\nmethods = ["mean_pose"]\n'
        f"vary.motion.longest_s = [2.0]\nvary.components.echo.share = {shares}\n"
    )
    return path


def _shares(cells: int) -> list[float]:
    return [0.001 * n for n in range(cells)]


def _small_scenario(cells: int) -> Scenario:
    """The scenario of the sweep with this number of cells."""
    scenario = load_scenario("demo")
    motion = replace(scenario.motion, test=CLIPS[:1], behaviours=("walking",), longest_s=2.0)
    return replace(scenario, motion=motion, methods=("mean_pose",), vary={"components.echo.share": _shares(cells)})


def _time_scoring(scenario: Scenario) -> Floats:
    """Time to evaluate all cells but the first, which also makes what they share; as in `_time_call`."""
    task = ClipTask(scenario, ClipPart.parse(scenario.motion.test[0]), scenario.motion.behaviours[0], None, "")
    method, evaluation, start = make_method(scenario.methods[0]), None, process_times()
    for index, cell in enumerate(task.cells()):
        if evaluation is None:
            source = open_scenario_motion(cell.scenario.motion, None, scenario.seed)
            evaluation = ClipEvaluation(cell.scenario, source, task.part, task.behaviour)
        evaluation = evaluation.with_conditions(cell.scenario) or evaluation
        evaluate_cell(evaluation, method, cell, "key", "")
        if index == 0:
            start = process_times()
    taken: Floats = process_times() - start
    return taken


def _parallel_rows(folder: Path, seed: int) -> list[BenchmarkStatement]:
    """Run the same sweep with one and two workers."""
    sweep = folder / "shared.toml"
    sweep.write_text(PARALLEL_SWEEP)
    one, two = (float(_time_sweep(sweep, folder / f"jobs-{jobs}", seed, jobs)[0]) for jobs in (1, 2))
    differing = _count_differing_lines(folder / "jobs-1" / "summary.csv", folder / "jobs-2" / "summary.csv")
    reference = f"{one:.1f} s with one, on {os.cpu_count()} cores"
    doubt = "there is one core only" if os.cpu_count() == 1 else overbooked()
    name = "lines of the table that differ between them"
    return [
        hold_to_limit("speed-up by a second job", one / two, "x", least=MIN_GAIN, reference=reference, doubt=doubt),
        hold_to_limit(name, float(differing), most=0.0, reference="without times"),
    ]


def _count_differing_lines(one: Path, two: Path) -> int:
    lines = [list(_untimed_lines(path)) for path in (one, two)]
    return sum(a != b for a, b in zip(*lines, strict=True))


def _untimed_lines(table: Path) -> Iterator[Mapping[str, str]]:
    with open(table, newline="", encoding="utf-8") as file:
        for line in csv.DictReader(file):
            yield {name: text for name, text in line.items() if name not in TIME_COLUMNS}


def _large_folder_rows(folder: Path, count: int) -> list[BenchmarkStatement]:
    """Time for status, table with summary, and report page of a folder with many cells."""
    out = folder / "many"
    _fabricate_cells(folder / "jobs-1", out, count)
    work: dict[str, Callable[[], Any]] = {
        "harness status": lambda: run_python("harness.cli", "status", str(out), "--json"),
        "summary.csv and groups": lambda: _write_summary(out),
        "harness report": lambda: run_python("harness.cli", "report", str(out), "--json"),
    }
    rows = []
    for name, call in work.items():
        wall_s, cpu_s = _time_call(call).tolist()
        reference = f"{wall_s:.1f} s; rows of a real sweep, each with a folder of linked files"
        rows.append(hold_cpu_to_limit(f"{count:,} finished cells: {name}", cpu_s, MAX_FOLDER_UNITS, reference))
    return rows


def _write_summary(out: Path) -> None:
    with CellIndex(out) as index:
        write_table(index, out / "summary.csv")
        compute_group_statistics(index)
        index.write_digest({})


def _fabricate_cells(real: Path, out: Path, count: int) -> None:
    """Repeat the rows of a real sweep with other latencies and seeds."""
    (out / "cells").mkdir(parents=True)
    for name in ("manifest.json", "summary.json"):
        shutil.copyfile(real / name, out / name)
    with CellIndex(real, read_only=True) as index:
        rows, facts = list(index.rows()), index.facts()
    rows = [row for row in rows if row["method"] != "ik"]
    files = [list((real / "cells" / row["key"]).iterdir()) for row in rows]
    fabricated = [(f"{n:032x}", _fabricate_row(rows[n % len(rows)], *divmod(n // len(rows), 20))) for n in range(count)]
    with CellIndex(out) as index:
        index.note(**facts)
        index.expect([key for key, _ in fabricated])
        index.add({**row, "key": key} for key, row in fabricated)
        index.record_outcomes((key, key, "") for key, _ in fabricated)
        index.write_digest({})
    for n, (key, _) in enumerate(fabricated):
        folder = out / "cells" / key
        folder.mkdir()
        for file in files[n % len(rows)]:
            os.link(file, folder / file.name)  # links to several cells, since a file has at most about 65,000 links


def _fabricate_row(row: Mapping[str, Any], seed: int, latency_ms: int) -> dict[str, Any]:
    return {**row, "seed": seed, "varied": {**row["varied"], "tracker.latency_s": 0.001 * latency_ms}}


def _time_sweep(sweep: Path, out: Path, seed: int, jobs: int = 1) -> Floats:
    words = ("sweep", str(sweep), "--out", str(out), "--jobs", str(jobs), "--seed", str(seed), "--json")
    return _time_call(lambda: run_python("harness.cli", *words))


def _time_call(work: Callable[[], Any]) -> Floats:
    """(2,) wall time, and CPU time of this process and its finished children [s]."""
    start = process_times()
    work()
    taken: Floats = process_times() - start
    return taken
