"""Methods cannot touch each other, the scores or the program, whatever they do."""

import os
import re
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.errors import Outcome
from harness.experiment import engine
from harness.experiment.methods.isolation import Isolation
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_motion import ScenarioMotion
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.results import Cell, read_summary, select_cells
from tests.experiment.evil_methods import FAILING, HANGING, HARMLESS, MARK, Honest, method_name

HONEST = method_name(Honest)
BYSTANDERS = ("mean_pose", HONEST)
"""A method of the package, which learns from examples, and one from outside."""
ONE_CLIP = Scenario(
    name="one_clip",
    motion=ScenarioMotion(
        "builtin", ("walking_p1_01",), ("walking",), ("walking_p1_02", "boxing_p2_01"), longest_s=2.0
    ),
    stations=load_scenario("demo").stations,
    methods=BYSTANDERS,
)
MEMORY_GB = 1.5


def run(out: Path, *methods: str, jobs: int = 1, isolation: Isolation | None = None) -> dict[str, Cell]:
    """The finished cells by method, of a run that must be whole unless a method is one that fails."""
    outcome = engine.run(
        replace(ONE_CLIP, methods=methods), out, jobs=jobs, isolation=isolation or Isolation(memory_limit_gb=MEMORY_GB)
    )
    cells = {cell.method: cell for cell in select_cells(out)}
    assert outcome is (Outcome.PASS if set(cells) == set(methods) else Outcome.INCOMPLETE)
    return cells


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Cell]:
    """The cells of the bystanders when nobody disturbs them."""
    return run(tmp_path_factory.mktemp("alone") / "run", *BYSTANDERS)


@pytest.fixture(scope="module")
def disturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run in which every evil method comes before the bystanders."""
    out = tmp_path_factory.mktemp("disturbed") / "run"
    run(out, *map(method_name, [*HARMLESS, *FAILING]), *BYSTANDERS, jobs=2)
    return out


@pytest.fixture(scope="module")
def cells(disturbed: Path) -> dict[str, Cell]:
    return {cell.method: cell for cell in select_cells(disturbed)}


def assert_same(cell: Cell, expected: Cell) -> None:
    """The same poses and the same errors, to the bit; times differ."""
    np.testing.assert_array_equal(cell.estimate_qpos, expected.estimate_qpos)
    np.testing.assert_array_equal(cell.truth_qpos, expected.truth_qpos)
    assert cell.metrics["joint_angle_mean_deg"] == expected.metrics["joint_angle_mean_deg"]
    assert cell.metrics["mpjpe_mm"] == expected.metrics["mpjpe_mm"]


@pytest.mark.long
@pytest.mark.parametrize("bystander", BYSTANDERS)
def test_other_methods_have_the_results_that_they_have_alone(
    bystander: str, cells: dict[str, Cell], alone: dict[str, Cell]
) -> None:
    assert_same(cells[bystander], alone[bystander])


@pytest.mark.long
@pytest.mark.parametrize("evil", HARMLESS, ids=lambda kind: kind.__name__)
def test_a_method_gains_nothing_by_what_it_tries(
    evil: type[Honest], cells: dict[str, Cell], alone: dict[str, Cell]
) -> None:
    assert_same(cells[method_name(evil)], alone[HONEST])


@pytest.mark.long
@pytest.mark.parametrize("evil", FAILING, ids=lambda kind: kind.__name__)
def test_a_method_that_fails_is_one_failed_cell(evil: type[Honest], disturbed: Path) -> None:
    summary = read_summary(disturbed)
    failure = summary["failures"][f"{method_name(evil)} on walking_p1_01"]
    assert re.search(FAILING[evil], failure), failure
    assert (summary["outcome"], summary["cells_planned"]) == ("incomplete", len(HARMLESS) + len(FAILING) + 2)


@pytest.mark.long
def test_no_process_is_left_behind(disturbed: Path) -> None:
    until_s = time.monotonic() + 10.0
    while (left := processes_with(MARK)) and time.monotonic() < until_s:
        time.sleep(0.1)
    assert left == []


def processes_with(argument: str) -> list[str]:
    """Numbers of the processes with this word in their command line."""
    found = []
    for place in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = place.read_bytes().split(b"\0")
        except OSError:
            continue  # it has ended meanwhile
        if argument.encode() in words:
            found.append(place.parent.name)
    return found


@pytest.mark.long
def test_a_method_that_hangs_is_ended_at_the_limit(tmp_path: Path) -> None:
    names = [method_name(kind) for kind in HANGING]
    found = run(tmp_path / "run", *names, "mean_pose", isolation=Isolation(time_limit_s=3.0))
    assert set(found) == {"mean_pose"}
    failures = read_summary(tmp_path / "run")["failures"]
    assert len(failures) == len(names)
    assert all("gave no answer within 3 s" in text for text in failures.values())


@pytest.mark.long
def test_methods_of_the_package_have_the_same_results_in_processes_of_their_own(tmp_path: Path) -> None:
    names = ("mean_pose", "ik:previous")
    here = run(tmp_path / "here", *names)
    apart = run(tmp_path / "apart", *names, isolation=Isolation(every_method=True))
    for name in names:
        assert_same(apart[name], here[name])
        assert apart[name].key == here[name].key


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux alone")
def test_a_smaller_memory_limit_of_the_user_holds(tmp_path: Path) -> None:
    """A method from outside runs where the user's limit, as of `ulimit -d`, is below that of the harness."""
    limit = f"{8 * 2**30}"
    program = (
        "import resource, sys; from pathlib import Path\n"
        f"resource.setrlimit(resource.RLIMIT_DATA, ({limit}, {limit}))\n"
        "from harness.experiment.methods.isolation import Isolation\n"
        "from tests.experiment.test_isolation import HONEST, run\n"
        "assert run(Path(sys.argv[1]), HONEST, isolation=Isolation(memory_limit_gb=12.0)).keys() == {HONEST}\n"
    )
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    subprocess.run([sys.executable, "-c", program, tmp_path / "run"], env=environment, check=True, timeout=300)
