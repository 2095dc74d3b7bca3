"""Sweeps: every cell once, whoever makes it and wherever it was stopped; one that fails stops no other."""

import json
import os
import shlex
import shutil
import signal
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import BrokenExecutor, Future
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from harness.cli import main
from harness.core.files import TEMPORARY
from harness.core.interrupts import REPEAT_S
from harness.errors import BadInput, Outcome
from harness.experiment import cells
from harness.experiment.engine import run_cells, run_sweep
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.experiment.scenarios.sweep_config import expand_sweep, load_sweep
from harness.experiment.tasks import ClipTask, cell_names, plan_tasks
from harness.experiment.workers.executors import R, TaskExecutor, run_in_process
from harness.results import TIME_COLUMNS, read_cell
from harness.results.files import folder_lock
from tests.experiment.made_up import FAILING, judge, made_up, sweep_file
from tests.results.finish import folder_bytes

__all__ = ["made_up"]


def sweep(file: Path, out: Path, executor: TaskExecutor = run_in_process, workers: int = 1, **more: Any) -> Outcome:
    read, path = load_sweep(file)
    more = {"folder": None, "command": "harness sweep x", **more}
    return run_sweep(read, expand_sweep(read, path), out, executor=executor, workers=workers, **more)


def untimed(table: Path) -> list[list[str]]:
    """The table without what is never twice the same."""
    header, *lines = (line.split(",") for line in table.read_text().splitlines())
    kept = [place for place, name in enumerate(header) if name not in TIME_COLUMNS]
    return [[line[place] for place in kept] for line in (header, *lines)]


def read(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text())
    return content


def backwards(
    function: Callable[..., R], tasks: Sequence[tuple[Any, ...]], /
) -> Generator[tuple[int, Future[R]], None, None]:
    """As workers that end in another order than they began."""
    yield from reversed(list(run_in_process(function, tasks)))


def test_every_cell_is_in_the_table_in_planned_order(made_up: Path) -> None:
    assert sweep(sweep_file(made_up), made_up / "out") is Outcome.PASS
    table = untimed(made_up / "out" / "summary.csv")
    found = [dict(zip(table[0], line, strict=True)) for line in table[1:]]
    assert [(row["vary.noise"], row["vary.tracker.rate_hz"], row["clip"], row["method"]) for row in found] == [
        (noise, rate, clip, method)
        for noise in ("clean", "default")
        for rate in ("20.0", "40.0")
        for clip in ("walking_p1_01", "boxing_p11_01")
        for method in ("ik:previous", "ik:previous+ik")
    ]
    assert {row["scenario"] for row in found} == {"demo"}
    summary = read(made_up / "out" / "summary.json")
    assert (summary["outcome"], summary["cells_finished"], summary["cells_planned"]) == ("pass", 16, 16)
    assert len(summary["groups"]) == 8
    assert summary["vary"] == {"noise": ["clean", "default"], "tracker.rate_hz": [20.0, 40.0]}
    assert (summary["kind"], summary["failures"]) == ("sweep", {})


def test_any_number_of_workers_in_any_order_gives_the_same_bytes(made_up: Path) -> None:
    file = sweep_file(made_up)
    sweep(file, made_up / "1")
    for workers in (2, 16):
        out = made_up / str(workers)
        sweep(file, out, executor=backwards, workers=workers)
        assert untimed(made_up / "1" / "summary.csv") == untimed(out / "summary.csv")
        assert (made_up / "1" / "summary.json").read_bytes() == (out / "summary.json").read_bytes()


@pytest.mark.parametrize("workers", [1, 2, 5, 16, 1000])
def test_tasks_are_all_cells_once_and_enough_for_all_workers(workers: int) -> None:
    scenario = replace(load_scenario("demo"), vary={"noise": ["clean", "noise", "default"], "seed": [1, 2]})
    one = replace(scenario, motion=replace(scenario.motion, test=("golf_p16_01",), behaviours=("golf",)))
    for asked in (scenario, one, replace(one, vary={})):
        names = cell_names(asked)
        tasks = plan_tasks([asked], None, "", workers)
        cut = [str(cell) for task in tasks for cell in task.cells()]
        assert sorted(cut) == sorted(names)
        assert len(tasks) >= min(workers, len(names))


def test_workers_begin_with_different_methods() -> None:
    """So that in a first run each compiles other functions."""
    first, second = (task.scenario.methods[0] for task in plan_tasks([load_scenario("demo")], None, "", 2)[:2])
    assert first != second
    assert plan_tasks([load_scenario("demo")], None, "", 1)[1].scenario.methods[0] == first


def test_a_sweep_goes_on_where_it_was(made_up: Path) -> None:
    out = made_up / "out"
    sweep(sweep_file(made_up), out)
    table = (out / "summary.csv").read_text()
    made = {path.name: path.stat().st_mtime_ns for path in (out / "cells").iterdir()}
    gone = sorted(made)[:3]
    for name in gone:
        shutil.rmtree(out / "cells" / name)
    for name in ("index.sqlite", "summary.csv"):
        (out / name).unlink()
    assert sweep(sweep_file(made_up), out) is Outcome.PASS
    again = {path.name: path.stat().st_mtime_ns for path in (out / "cells").iterdir()}
    assert set(again) == set(made)
    assert sorted(name for name in made if again[name] != made[name]) == gone
    (out / "again.csv").write_text(table)
    assert untimed(out / "summary.csv") == untimed(out / "again.csv")


def test_more_methods_are_added_and_other_sweeps_refused(made_up: Path) -> None:
    out = made_up / "out"
    sweep(sweep_file(made_up, methods='["ik:previous"]'), out)
    assert len(list((out / "cells").iterdir())) == 8
    sweep(sweep_file(made_up), out)
    assert len(list((out / "cells").iterdir())) == 16
    with pytest.raises(BadInput, match=r"another run \(differs in scenarios\.demo seed 1\.motion\.test"):
        sweep(sweep_file(made_up, clips='["walking_p1_01"]'), out)
    (made_up / "mine").mkdir()
    (made_up / "mine" / "thesis.tex").write_text("years of work")
    with pytest.raises(BadInput, match=r"thesis\.tex"):
        sweep(sweep_file(made_up), made_up / "mine")
    before = folder_bytes(out)
    with folder_lock(out), pytest.raises(BadInput, match="Another process uses"):
        sweep(sweep_file(made_up), out)
    assert folder_bytes(out) == before


def test_a_cell_that_fails_stops_no_other_and_its_command_makes_it_again(
    made_up: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (made_up / "broken").touch()
    command = ["sweep", str(sweep_file(made_up)), "--out", "out", "--seed", "3"]
    assert main(command) == 4
    assert "FAILED 8, such as demo seed 3: ik:previous+ik on walking_p1_01" in capsys.readouterr().out
    summary = read(made_up / "out" / "summary.json")
    failures = summary["failures"]
    assert (len(failures), summary["cells_finished"]) == (8, 8)
    name, failed = next(iter(failures.items()))
    assert name == "demo seed 3: ik:previous+ik on walking_p1_01 (noise=clean tracker.rate_hz=20)"
    assert failed.startswith("Traceback")
    assert "ZeroDivisionError: on purpose" in failed
    assert main(["status", "out"]) == 4
    (again,) = (line for line in capsys.readouterr().out.splitlines() if "--cell" in line)
    pasted = shlex.split(again.partition(": ")[2])
    assert pasted[0] == "harness"
    assert main(pasted[1:]) == 4
    assert "ZeroDivisionError: on purpose" in capsys.readouterr().err
    (made_up / "broken").unlink()
    assert main(pasted[1:]) == 4, "seven others still lack"
    assert name not in read(made_up / "out" / "summary.json")["failures"]
    assert read(made_up / "out" / "summary.json")["cells_finished"] == 9
    assert main(command) == 0
    assert read(made_up / "out" / "summary.json")["failures"] == {}


def test_a_cell_of_another_name_is_refused_with_the_nearest(made_up: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name = "demo seed 1: ik:previus+ik on walking_p1_01 (noise=clean tracker.rate_hz=20)"
    assert main(["sweep", str(sweep_file(made_up)), "--out", "out", "--cell", name]) == 2
    assert f"Did you mean '{name.replace('previus', 'previous')}'?" in capsys.readouterr().err
    assert not (made_up / "out").exists()


def test_a_worker_that_dies_takes_one_cell_with_it(made_up: Path) -> None:
    """Its task is made again cell by cell; the one that kills once more has failed."""
    name = "demo seed 1: ik:previous+ik on boxing_p11_01 (noise=clean tracker.rate_hz=40)"

    def deadly(
        function: Callable[..., R], tasks: Sequence[tuple[Any, ...]], /
    ) -> Generator[tuple[int, Future[R]], None, None]:
        for which, task in enumerate(tasks):
            (job,) = (part for part in task if isinstance(part, ClipTask))
            if name in map(str, job.cells()):
                future = Future[R]()
                future.set_exception(BrokenExecutor("killed"))
                yield which, future
            else:
                yield from ((which, future) for _, future in run_in_process(function, [task]))

    out = made_up / "out"
    assert sweep(sweep_file(made_up), out, executor=deadly) is Outcome.INCOMPLETE
    failures = read(out / "summary.json")["failures"]
    assert failures == {name: "a worker process died"}
    assert read(out / "summary.json")["cells_finished"] == 15


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_first_ctrl_c_lets_cells_finish(
    made_up: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], number: signal.Signals
) -> None:
    def struck(*asked: Any) -> Any:
        monkeypatch.setattr(cells, "evaluate_cell", judge)
        os.kill(os.getpid(), number)
        return judge(*asked)

    monkeypatch.setattr(cells, "evaluate_cell", struck)
    command = ["sweep", str(sweep_file(made_up)), "--out", "out"]
    assert main(command) == 130
    said = capfd.readouterr()
    assert said.out.splitlines()[-1] == "interrupted"
    assert "again stops it at once" in said.err
    assert "the same command resumes" in said.err
    assert read(made_up / "out" / "summary.json")["cells_finished"] == 1
    assert len(untimed(made_up / "out" / "summary.csv")) == 2
    assert not list((made_up / "out").glob(f"{TEMPORARY}*"))
    assert main(command) == 0


def test_the_second_ctrl_c_stops_at_once(made_up: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def struck(*asked: Any) -> Any:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(1.2 * REPEAT_S)  # earlier, it would belong to the first
        os.kill(os.getpid(), signal.SIGINT)
        return judge(*asked)

    monkeypatch.setattr(cells, "evaluate_cell", struck)
    before = signal.getsignal(signal.SIGINT)  # what a shell starts in the background ignores it
    assert main(["sweep", str(sweep_file(made_up)), "--out", "out"]) == 130
    assert list((made_up / "out" / "cells").iterdir()) == []
    assert signal.getsignal(signal.SIGINT) is before


def test_what_measured_nothing_is_not_comparable(made_up: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def silent(*asked: Any) -> Any:
        cell = judge(*asked)
        none = dict.fromkeys(cell.metrics, None)
        return replace(cell, scores=replace(cell.scores, metrics={**none, "frames_matched": 0, "frames_expected": 9}))

    monkeypatch.setattr(cells, "evaluate_cell", silent)
    assert sweep(sweep_file(made_up), made_up / "out") is Outcome.NOT_COMPARABLE


def test_cells_are_asked_for_again_and_again_in_one_folder(made_up: Path) -> None:
    """As a search does: rows of what was asked for, in its order; what is finished is not made again."""
    scenario = replace(load_scenario("demo"), methods=("ik:previous", FAILING))
    one = replace(scenario.motion, test=("walking_p1_01",), behaviours=("walking",))
    scenario = replace(scenario, motion=one, vary={"noise": ["clean", "default"]})
    (made_up / "broken").touch()
    first = run_cells([scenario], made_up, folder=None, executor=run_in_process, command="")
    assert (first.planned, len(first.rows), len(first.failures)) == (4, 2, 2)
    made = {cell.key for cell in read_cells_of(made_up)}
    more = replace(scenario, methods=("ik:previous",), vary={"noise": ["noise", "clean"]})
    second = run_cells([more], made_up, folder=None, executor=run_in_process, command="")
    assert [row["varied"]["noise"] for row in second.rows] == ["noise", "clean"]
    assert [row["seconds"] is not None for row in second.rows] == [True, True]
    assert len({cell.key for cell in read_cells_of(made_up)} - made) == 1
    with pytest.raises(BadInput, match="Two cells are called 'demo seed 1: ik:previous on walking_p1_01"):
        run_cells([more, more], made_up, folder=None, executor=run_in_process, command="")


def read_cells_of(out: Path) -> list[Any]:
    return [read_cell(folder) for folder in (out / "cells").iterdir()]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"scenarios": '["dmeo"]'}, "Did you mean 'demo'"),
        ({"clips": '["walking_p1_1"]'}, "Did you mean 'walking_p1_01'"),
        ({"methods": '["ik:previos"]'}, "Did you mean 'ik:previous'"),
        ({"noise": '["cleen"]'}, "Did you mean 'clean'"),
        ({"tracker.rate_hz": '["fast"]'}, "expected a number"),
        ({"tracker.rate_hz": "[20.0, 20.0]"}, "not a list of different values"),
        ({"seeds": "[1, 1]"}, "seeds names something twice"),
        ({"metods": '["ik"]'}, "Did you mean 'methods'"),
        ({"inputs": '["position"]'}, "input combination"),
        ({"scenarios": '["demo", "walking"]'}, "none of the clips of walking"),
        ({"scenarios": "[]"}, "no scenarios"),
        ({"schema": "2"}, "schema 2"),
        ({"name": '"../elsewhere"'}, "a plain name"),
        ({"motion": "{}"}, "no key in sweep called 'motion'"),
    ],
)
def test_names_that_do_not_exist_are_refused_before_anything_is_written(
    made_up: Path, capsys: pytest.CaptureFixture[str], change: dict[str, str], message: str
) -> None:
    assert main(["sweep", str(sweep_file(made_up, **change)), "--out", "out"]) == 2
    assert message in capsys.readouterr().err
    assert not (made_up / "out").exists()


def test_a_key_to_vary_that_does_not_exist_is_refused(made_up: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = sweep_file(made_up)
    file.write_text(file.read_text().replace("tracker.rate_hz", "tracker.rate_herz"))
    assert main(["sweep", str(file), "--out", "out"]) == 2
    assert "Did you mean 'rate_hz'" in capsys.readouterr().err


def test_scenarios_beside_the_sweep_and_what_they_vary_are_taken(made_up: Path) -> None:
    demo = Path("scenarios/demo.toml")
    text = (Path(__file__).parents[2] / demo).read_text()
    (made_up / "mine.toml").write_text(f"{text}\n[vary]\nnoise = ['noise']\ncalibration = ['exact', 'tpose']\n")
    read, path = load_sweep(sweep_file(made_up, scenarios='["mine"]', seeds="[3, 4]"))
    made = expand_sweep(read, path)
    assert [(scenario.name, scenario.seed) for scenario in made] == [("mine", 3), ("mine", 4)]
    assert made[0].vary == {
        "noise": ["clean", "default"],
        "calibration": ["exact", "tpose"],
        "tracker.rate_hz": [20.0, 40.0],
    }
    assert made[0].motion.behaviours == ("walking", "boxing")
    assert [scenario.seed for scenario in expand_sweep(read, path, seed=9)] == [9]


def test_shipped_sweeps_exist_and_can_be_run() -> None:
    read, path = load_sweep("noise_and_rate")
    (scenario,) = expand_sweep(read, path)
    assert len(cell_names(scenario)) == 216
