"""Sweeps: what the machinery costs a cell, what a second worker is worth, and how long 100,000 cells take to read.

The command line does the work, in processes of its own, as a user's would. What a cell costs without it is measured
beside: the same cells judged one after another in this process, and written nowhere. The 100,000 are made up: real
rows of one small sweep in the index, each with a folder that holds links to the files of a real cell.
"""

import csv
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.bench.rows import BenchmarkRow
from harness.core.arrays import Floats
from harness.core.split import ClipPart
from harness.experiment.cells import ClipTask, evaluate_cell, open_scenario_motion
from harness.experiment.clip_evaluation import ClipEvaluation
from harness.experiment.scenario import Scenario, load_scenario
from harness.reconstruct import registry
from harness.results.index import CellIndex
from harness.results.table import TIME_COLUMNS, compute_group_statistics, write_table

MANY_CELLS = 100_000
SMALL_SWEEP, TINY_SWEEP = 200, 20
"""Cells of the two sweeps between which the overhead is measured: either draws its page."""
REPEATS = 3
"""The quickest counts: whatever else the computer does only ever adds."""
CLIPS = ("walking_p1_01", "boxing_p1_01", "jumping_p1_01", "golf_p1_01")
PARALLEL_SWEEP = f"""
schema = 1
scenarios = ["demo"]
clips = {json.dumps(CLIPS)}
methods = ["ik", "local_pca", "dynamic_map"]

[vary]
components.echo.share = {[0.01 * n for n in range(16)]}
"""
"""What one worker and two do: two minutes' work for one, beside which starting and the page are little."""


def bench_sweep(seed: int = 1, *, cells: int = SMALL_SWEEP, many: int = MANY_CELLS) -> list[BenchmarkRow]:
    with tempfile.TemporaryDirectory(prefix="harness-sweep-") as folder:
        return [
            *_overhead_rows(Path(folder), seed, cells),
            *_parallel_rows(Path(folder), seed),
            *_large_folder_rows(Path(folder), many),
        ]


def _overhead_rows(folder: Path, seed: int, cells: int) -> list[BenchmarkRow]:
    """A sweep of many small cells beside one of a few, and beside judging them."""
    some, all_of_them = _write_sweep(folder, TINY_SWEEP), _write_sweep(folder, cells)
    scenario = replace(_small_scenario(cells), seed=seed)
    took: dict[str, list[Floats]] = {"few": [], "again": [], "all": [], "judged": []}
    for repeat in range(REPEATS):
        took["few"].append(_time_sweep(some, folder / f"few-{repeat}", seed))
        took["again"].append(_time_sweep(some, folder / f"few-{repeat}", seed))
        took["all"].append(_time_sweep(all_of_them, folder / f"all-{repeat}", seed))
        took["judged"].append(_time_scoring(scenario) / (cells - 1))
    quickest = {name: np.min(of, axis=0) for name, of in took.items()}
    more = cells - TINY_SWEEP
    each_ms = 1e3 * ((quickest["all"] - quickest["few"]) / more - quickest["judged"])
    again_ms = 1e3 * (_time_sweep(all_of_them, folder / "all-0", seed) - quickest["again"]) / more
    judged_ms, (few_s, _) = 1e3 * quickest["judged"][0], quickest["few"]
    beside = (
        f"{each_ms[1]:.1f} ms of it CPU; {judged_ms:.0f} ms to judge one, {few_s:.1f} s for a sweep of {TINY_SWEEP}"
    )
    return [
        BenchmarkRow("a sweep's overhead for each cell", float(each_ms[0]), "ms", beside, "<= 20"),
        BenchmarkRow("going on with a sweep, for each finished cell", float(again_ms[0]), "ms", f"{cells} cells", ""),
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
    """What the study of so many cells comes to."""
    scenario = load_scenario("demo")
    motion = replace(scenario.motion, test=CLIPS[:1], behaviours=("walking",), longest_s=2.0)
    return replace(scenario, motion=motion, methods=("mean_pose",), vary={"components.echo.share": _shares(cells)})


def _time_scoring(scenario: Scenario) -> Floats:
    """All cells but the first, which also makes what the others share; as `_time_call`."""
    job = ClipTask(scenario, ClipPart.parse(scenario.motion.test[0]), scenario.motion.behaviours[0], None, "")
    method, setting, start = registry.resolve(scenario.methods[0]), None, _process_times()
    for place, cell in enumerate(job.cells()):
        if setting is None:
            source = open_scenario_motion(cell.scenario.motion, None, scenario.seed)
            setting = ClipEvaluation(cell.scenario, source, job.part, job.behaviour)
        setting = setting.with_conditions(cell.scenario) or setting
        evaluate_cell(setting, method, cell, "key", "")
        if place == 0:
            start = _process_times()
    return _process_times() - start


def _parallel_rows(folder: Path, seed: int) -> list[BenchmarkRow]:
    """The same sweep by one worker and by two."""
    study = folder / "shared.toml"
    study.write_text(PARALLEL_SWEEP)
    one, two = (float(_time_sweep(study, folder / f"jobs-{jobs}", seed, jobs)[0]) for jobs in (1, 2))
    differing = _count_differing_lines(folder / "jobs-1" / "summary.csv", folder / "jobs-2" / "summary.csv")
    return [
        BenchmarkRow(
            "two jobs against one", one / two, "x", f"{one:.1f} s by one, on {os.cpu_count()} cores", ">= 1.7"
        ),
        BenchmarkRow("lines of the table that differ between them", float(differing), "", "times apart", "0"),
    ]


def _count_differing_lines(one: Path, two: Path) -> int:
    lines = [list(_untimed_lines(path)) for path in (one, two)]
    return sum(a != b for a, b in zip(*lines, strict=True))


def _untimed_lines(table: Path) -> Iterator[Mapping[str, str]]:
    with open(table, newline="", encoding="utf-8") as file:
        for line in csv.DictReader(file):
            yield {name: text for name, text in line.items() if name not in TIME_COLUMNS}


def _large_folder_rows(folder: Path, count: int) -> list[BenchmarkRow]:
    """How far such a folder is, what is in it, and its page."""
    out = folder / "many"
    _fabricate_cells(folder / "jobs-1", out, count)
    work: dict[str, Callable[[], Any]] = {
        "harness status": lambda: _run_harness("status", str(out), "--json"),
        "summary.csv and groups": lambda: _write_summary(out),
        "harness report": lambda: _run_harness("report", str(out), "--json"),
    }
    rows = []
    for name, todo in work.items():
        wall_s, cpu_s = _time_call(todo).tolist()
        beside = f"{cpu_s:.1f} s CPU; made up of a real sweep's rows, a folder of linked files for each"
        rows.append(BenchmarkRow(f"{count:,} finished cells: {name}", wall_s, "s", beside, "<= 10"))
    return rows


def _write_summary(out: Path) -> None:
    with CellIndex(out) as index:
        write_table(index, out / "summary.csv")
        compute_group_statistics(index)


def _fabricate_cells(real: Path, out: Path, count: int) -> None:
    """Every row of a real sweep again and again, under other latencies and as other seeds."""
    (out / "cells").mkdir(parents=True)
    for name in ("manifest.json", "summary.json"):
        shutil.copyfile(real / name, out / name)
    with CellIndex(real, read_only=True) as index:
        rows, facts = list(index.rows()), index.facts()
    rows = [row for row in rows if row["method"] != "ik"]
    files = [list((real / "cells" / row["key"]).iterdir()) for row in rows]
    made = [(f"{n:032x}", _fabricate_row(rows[n % len(rows)], *divmod(n // len(rows), 20))) for n in range(count)]
    with CellIndex(out) as index:
        index.note(**facts)
        index.expect([key for key, _ in made])
        index.add({**row, "key": key} for key, row in made)
        index.record_outcomes((key, key, "") for key, _ in made)
    for n, (key, _) in enumerate(made):
        folder = out / "cells" / key
        folder.mkdir()
        for file in files[n % len(rows)]:
            os.link(file, folder / file.name)  # of many, for a file has no more than some 65,000 names


def _fabricate_row(row: Mapping[str, Any], seed: int, latency_ms: int) -> dict[str, Any]:
    return {**row, "seed": seed, "varied": {**row["varied"], "tracker.latency_s": 0.001 * latency_ms}}


def _time_sweep(study: Path, out: Path, seed: int, jobs: int = 1) -> Floats:
    asked = ("sweep", str(study), "--out", str(out), "--jobs", str(jobs), "--seed", str(seed), "--json")
    return _time_call(lambda: _run_harness(*asked))


def _run_harness(*words: str) -> None:
    done = subprocess.run([sys.executable, "-m", "harness.cli", *words], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"harness {' '.join(words)}: {done.stderr.strip()[-2000:]}")


def _time_call(work: Callable[[], Any]) -> Floats:
    """(2,) wall time, and CPU time of this process and those that it waited for [s]."""
    start = _process_times()
    work()
    return _process_times() - start


def _process_times() -> Floats:
    theirs = resource.getrusage(resource.RUSAGE_CHILDREN)
    return np.array([time.perf_counter(), time.process_time() + theirs.ru_utime + theirs.ru_stime])
