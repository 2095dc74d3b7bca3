"""Many cells come out the same to the byte, however many work at them and whoever is killed meanwhile."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from dataclasses import replace
from hashlib import blake2b
from importlib.util import find_spec
from pathlib import Path
from threading import Event, Thread
from typing import Any, TypeVar

import numpy as np
import pytest

from harness.core.files import TEMPORARY
from harness.core.split import ClipPart
from harness.errors import BadInput
from harness.experiment.cells import run_task
from harness.experiment.engine import BatchResults, run_cells
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.tasks import ClipTask
from harness.experiment.workers.executors import TaskExecutor, dask_executor, process_executor, run_in_process
from tests.study.papers.tiny import WALKS

R = TypeVar("R")

NOISY = replace(WALKS, noise="default", vary={"components.echo.share": [0.0, 0.1, 0.2]})
TIMED = ("step_", "reference_cpu_ms", "first_step_ms", "fps", "seconds")
"""How names begin of what no two runs have alike."""


def told(cells: BatchResults) -> list[str]:
    """The table: all that each row says but for times."""
    return [json.dumps({k: v for k, v in row.items() if not k.startswith(TIMED)}) for row in cells.rows]


def kept(out: Path) -> dict[str, str]:
    """Cell -> digest of all that its folder holds but for times."""
    digests = {}
    for folder in (out / "cells").iterdir():
        assert not folder.name.startswith(TEMPORARY)
        content = json.loads((folder / "cell.json").read_text())
        del content["reproduce"]  # names the folder
        for name in ("sha256", "frames_sha256"):  # of the times too
            del content[name]
        content["metrics"] = {k: v for k, v in content["metrics"].items() if not k.startswith(TIMED)}
        state = blake2b(json.dumps(content).encode())
        with np.load(folder / "frames.npz") as frames:
            for name in sorted(frames.files):
                if not name.startswith(TIMED):
                    state.update(name.encode() + frames[name].tobytes())
        digests[folder.name] = state.hexdigest()
    return digests


def ran(out: Path, executor: TaskExecutor, scenario: Scenario = NOISY, workers: int = 2) -> BatchResults:
    out.mkdir(exist_ok=True)
    return run_cells([scenario], out, folder=None, executor=executor, command="harness sweep it", workers=workers)


def children(pid: int) -> list[int]:
    """Processes that a process started, and that work."""
    with suppress(OSError):  # one is gone meanwhile
        started = [thread.read_text().split() for thread in Path(f"/proc/{pid}/task").glob("*/children")]
        named = {int(child): Path(f"/proc/{child}/cmdline").read_bytes() for some in started for child in some}
        return [child for child, command in named.items() if b"spawn_main" in command]
    return []


@contextmanager
def killing(out: Path, after: Callable[[int], bool], times: int = 1) -> Iterator[list[int]]:
    """Kill a worker of this process so often, whenever `after` says so of the count of finished cells; who was."""
    killed, over = list[int](), Event()

    def watch() -> None:
        while len(killed) < times and not over.is_set():
            if after(finished(out)) and (workers := [w for w in children(os.getpid()) if w not in killed]):
                os.kill(workers[0], signal.SIGKILL)
                killed.append(workers[0])
            time.sleep(0.02)

    thread = Thread(target=watch)
    thread.start()
    try:
        yield killed
    finally:
        over.set()
        thread.join()


def test_cells_cut_for_one_worker_or_sixteen_have_the_same_bytes(tmp_path: Path) -> None:
    scenario = replace(NOISY, vary={"components.echo.share": [0.0, 0.1]}, methods=("mean_pose",))
    one = ran(tmp_path / "one", run_in_process, scenario, workers=1)
    many = ran(tmp_path / "many", backwards, scenario, workers=16)
    assert told(one) == told(many)
    assert kept(tmp_path / "one") == kept(tmp_path / "many")
    assert len(one.rows) == one.planned == 4


def test_a_worker_that_does_not_see_the_folder_makes_none_of_its_own(tmp_path: Path) -> None:
    job = ClipTask(NOISY, ClipPart("walking_p1_01"), "walking", None, "")
    with pytest.raises(BadInput, match="does not see"):
        list(run_task("session", job, tmp_path / "elsewhere", tmp_path / "stop"))
    assert not list(tmp_path.iterdir())


def backwards(
    function: Callable[..., R], tasks: Sequence[tuple[Any, ...]], /
) -> Generator[tuple[int, Future[R]], None, None]:
    """As workers may end: the last task first."""
    for which, future in run_in_process(function, tasks[::-1]):
        yield len(tasks) - 1 - which, future


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [2, 16])
def test_workers_of_whom_some_are_killed_give_the_bytes_of_one(tmp_path: Path, jobs: int) -> None:
    one = ran(tmp_path / "one", run_in_process)
    with (
        process_executor(jobs) as executor,
        killing(tmp_path / "many", lambda count: count >= 2, times=2) as killed,
    ):
        many = ran(tmp_path / "many", executor, workers=jobs)
    assert len(killed) == 2
    assert many.failures == {}
    assert told(one) == told(many)
    assert kept(tmp_path / "one") == kept(tmp_path / "many")


@pytest.mark.slow
@pytest.mark.skipif(find_spec("distributed") is None, reason="no Dask: extra `cluster` is not installed")
def test_workers_of_a_cluster_of_whom_some_are_killed_give_the_bytes_of_one(tmp_path: Path) -> None:
    one = ran(tmp_path / "one", run_in_process)
    with dask_executor("local", workers=2) as each, killing(tmp_path / "many", lambda count: count >= 2, 2) as killed:
        many = ran(tmp_path / "many", each)
    assert len(killed) == 2
    assert many.failures == {}
    assert told(one) == told(many)
    assert kept(tmp_path / "one") == kept(tmp_path / "many")


@pytest.mark.slow
@pytest.mark.skipif(find_spec("distributed") is None, reason="no Dask: extra `cluster` is not installed")
def test_two_thousand_cells_of_a_cluster_that_loses_one_of_two_workers_are_those_of_one_process(tmp_path: Path) -> None:
    motion = replace(NOISY.motion, longest_s=1.2)
    shares = {"components.echo.share": [n / 2000 for n in range(1000)]}
    scenario = replace(NOISY, motion=motion, vary=shares, methods=("mean_pose",))
    with dask_executor("local", workers=2) as each, killing(tmp_path / "many", lambda count: count >= 500) as killed:
        many = ran(tmp_path / "many", each, scenario)
    assert len(killed) == 1
    assert many.failures == {}
    assert len(many.rows) == many.planned == 2000
    one = ran(tmp_path / "one", run_in_process, scenario, workers=1)
    assert told(one) == told(many)
    assert kept(tmp_path / "one") == kept(tmp_path / "many")


STUDY = """
schema = 1
scenarios = ["demo"]
clips = ["walking_p1_01", "boxing_p11_01", "golf_p16_01"]
methods = ["mean_pose", "ik:previous"]

[vary]
motion.longest_s = [2.0]
components.echo.share = [0.0, 0.02, 0.04, 0.06, 0.08, 0.1, 0.12, 0.14, 0.16, 0.18, 0.2, 0.22, 0.24, 0.26, 0.28, 0.3]
"""


@contextmanager
def sweep(study: Path, out: Path) -> Iterator["subprocess.Popen[bytes]"]:
    """The verb, with two workers."""
    command = [sys.executable, "-m", "harness.cli", "sweep", str(study), "--out", str(out), "--jobs", "2"]
    with open(out.with_suffix(".txt"), "ab") as said, subprocess.Popen(command, stdout=said, stderr=said) as program:
        try:
            yield program
        finally:
            program.kill()


def table(out: Path) -> list[dict[str, str]]:
    with open(out / "summary.csv", newline="") as file:
        return [{k: v for k, v in row.items() if not k.startswith(TIMED)} for row in csv.DictReader(file)]


def finished(out: Path) -> int:
    return len([path for path in (out / "cells").glob("*") if not path.name.startswith(TEMPORARY)])


@pytest.mark.slow
def test_ten_times_someone_is_killed_at_random_and_the_table_is_that_of_an_undisturbed_sweep(
    tmp_path: Path, rng: np.random.Generator
) -> None:
    study, killed = tmp_path / "killed.toml", list[str]()
    study.write_text(STUDY)
    with sweep(study, tmp_path / "calm") as program:
        assert program.wait() == 0
    out = tmp_path / "wild"
    while len(killed) < 10:
        with sweep(study, out) as program:
            while program.poll() is None and len(killed) < 10:
                enough = finished(out) + int(rng.integers(0, 6))
                while finished(out) < enough and program.poll() is None:
                    time.sleep(0.01)
                time.sleep(float(rng.uniform(0.0, 0.5)))
                workers = children(program.pid)
                if workers and rng.random() < 0.5:
                    os.kill(workers[int(rng.integers(len(workers)))], signal.SIGKILL)
                    killed.append("a worker")
                elif program.poll() is None:
                    program.kill()
                    program.wait()
                    killed.append("the coordinator")
        assert program.returncode in (0, 4, -signal.SIGKILL), out.with_suffix(".txt").read_text()
        if finished(out) == len(table(tmp_path / "calm")):  # the rest of the rounds goes on somewhere else
            assert_alike(study, tmp_path / "calm", out)
            out = tmp_path / f"wild{len(killed)}"
    assert set(killed) == {"a worker", "the coordinator"}
    assert_alike(study, tmp_path / "calm", out)


def assert_alike(study: Path, calm: Path, wild: Path) -> None:
    with sweep(study, wild) as program:
        assert program.wait() == 0, wild.with_suffix(".txt").read_text()
    assert table(calm) == table(wild)
    assert kept(calm) == kept(wild)
    assert len(table(calm)) == 96
