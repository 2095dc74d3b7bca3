"""Gates in a project's own tests: the verdicts as failures, what reports are told, and that others are left alone."""

import inspect
import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

from harness.compare import write_baseline
from harness.core.progress import ProgressCallback
from harness.errors import BadInput, Outcome
from harness.experiment.scenarios import Scenario, load_scenario
from harness.results import Manifest, describe_run, load_results
from harness.testing.plugin import format_annotations
from harness.testing.regression_gate import RegressionGate, scenario_from_manifest
from tests.compare.sides import side, write_run
from tests.testing import upright

pytest_plugins = ["pytester"]

TINY = replace(load_scenario("demo"), name="tiny", methods=(), expected_order=())
SMALL = """
methods = ["ik"]
noise = "clean"
[motion]
source = "builtin"
body = "common"
longest_s = 1.5
behaviours = ["walking"]
test = ["walking_p1_01", "walking_p1_02", "walking_p1_03", "walking_p2_01", "walking_p2_02", "walking_p2_03"]
[stations]
head = { bone = "head", along = 1.0 }
"""
ONE = "def test_mine(harness_gate):\n    harness_gate('mine:Mine', baseline='main'{})\n"
CHANGE = {"now": 1.0}
"""How large the errors are that the made-up runs measure from here on."""


def measured(scenario: Scenario, out: Path, *, command: str = "", **changes: Any) -> Path:
    """The folder of a run of eight clips that was never run, of errors as `CHANGE` has them."""
    sides = side(methods=dict.fromkeys(scenario.methods, CHANGE["now"]), scenario=scenario.name, **changes)
    of_it = describe_run(asdict(scenario), motion_source="made up", command=command)
    return write_run(out, replace(sides, manifest=of_it))


def run(scenario: Scenario, out: Path, *, jobs: int, command: str, progress: ProgressCallback) -> Outcome:
    """Instead of `harness.run`, in processes that have one thread each."""
    assert jobs > 1
    assert os.environ["OMP_NUM_THREADS"] == os.environ["OPENBLAS_NUM_THREADS"] == "1"
    measured(scenario, out, command=command)
    progress("the last cell", 8, 8)
    return Outcome.PASS


@pytest.fixture
def project(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """Somebody's project with a baseline `main` of two methods; its methods are as good as `CHANGE` says."""
    monkeypatch.setattr("harness.testing.regression_gate.run_scenario", run)
    monkeypatch.setitem(CHANGE, "now", 1.0)
    monkeypatch.delenv("GITHUB_ACTIONS", raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    first = measured(replace(TINY, methods=("mine:Mine", "ik")), pytester.path / "first")
    write_baseline(first, "main", pytester.path / "results/baselines")
    return pytester


def gated(
    project: pytest.Pytester, source: str = ONE.format(""), *options: str, says: Sequence[str] = (), **outcomes: int
) -> pytest.RunResult:
    """Run a test, which has these outcomes, by default passes, and prints lines that match these patterns."""
    project.makepyfile(source)
    result = project.runpytest_inprocess("-p", "harness.testing.plugin", "-p", "no:cacheprovider", *options)
    result.assert_outcomes(**(outcomes or {"passed": 1}))
    if says:
        result.stdout.fnmatch_lines([*says])
    return result


def test_a_method_that_is_as_it_was_passes(project: pytest.Pytester) -> None:
    gated(project)
    assert os.environ["OMP_NUM_THREADS"] == "3"


def test_a_worse_method_fails_with_the_table(project: pytest.Pytester) -> None:
    CHANGE["now"] = 1.2
    says = ["B is worse than A in 3 of 3 gated lines on 8 takes: *", "A: baseline main"]
    result = gated(project, says=says, failed=1)
    result.stdout.fnmatch_lines(["*mine:Mine*mpjpe_mm*worse*8*"])
    result.stdout.no_fnmatch_line("*Traceback*")
    result.stdout.no_fnmatch_line("*gate.py*")


def test_a_better_method_passes_and_one_may_be_held_to_another(project: pytest.Pytester) -> None:
    CHANGE["now"] = 0.8
    gated(project, ONE.replace("mine:Mine", "new:New").format(", baseline_method='ik'"))


def test_other_metrics_may_be_chosen(project: pytest.Pytester) -> None:
    CHANGE["now"] = 1.2
    says = ["B is worse than A in 1 of 1 gated line on 8 takes: *"]
    gated(project, ONE.format(", metrics=('mpjpe_mm',)"), says=says, failed=1)


def test_what_is_not_comparable_fails_and_says_why(project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    def otherwise(scenario: Scenario, out: Path, **_: Any) -> Outcome:
        measured(scenario, out, defined_by={"tracker": {"rate_hz": 60.0, "items": [40, 2]}})
        return Outcome.PASS

    monkeypatch.setattr("harness.testing.regression_gate.run_scenario", otherwise)
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    monkeypatch.delenv("GITHUB_WORKSPACE", raising=False)
    result = gated(project, says=["*worse than A: inputs differ: tracker.rate_hz: 40* against 60*"], failed=1)
    result.stdout.fnmatch_lines(["::error file=test_*.py,line=1,title=not comparable::inputs differ: *"])


def test_cells_that_failed_are_told_with_their_traceback(
    project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(scenario: Scenario, out: Path, **_: Any) -> Outcome:
        measured(scenario, out, failed=("mine:Mine on walk_09",))
        return Outcome.INCOMPLETE

    monkeypatch.setattr("harness.testing.regression_gate.run_scenario", failing)
    gated(project, says=["*planned cells are missing*mine:Mine on walk_09*", "Traceback: no pose"], failed=1)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        ("'mine:Mine', baseline='other'", "There is no baseline other in *results/baselines*--harness-save*"),
        ("'new:New', baseline='main'", "Baseline main has no new:New but several others: *ik*baseline_method=*"),
        ("'mine:Mine', baseline='main', baseline_method='ikk'", "*Did you mean 'ik'*"),
        ("'mine:Mine', baseline='main', metrics=('mpjpe',)", "*Did you mean 'mpjpe_mm'*"),
    ],
)
def test_what_cannot_be_gated_fails_in_one_line(project: pytest.Pytester, call: str, told: str) -> None:
    source = f"def test_mine(harness_gate):\n    harness_gate({call})\n"
    result = gated(project, source, says=[f"harness: {told}"], failed=1)
    result.stdout.no_fnmatch_line("*exception*")


def test_a_first_baseline_is_kept_and_then_held_to(project: pytest.Pytester) -> None:
    source = ONE.format(", scenario='demo'").replace("'main'", "'fresh'")
    says = [
        "harness: running mine:Mine, which takes minutes",
        "harness: mine:Mine was saved as baseline *results/baselines/fresh; nothing was compared",
    ]
    gated(project, source, "--harness-save", says=says, skipped=1)
    kept = load_results(project.path / "results/baselines/fresh")
    assert {cell.method for cell in kept.cells} == {"mine:Mine"}
    assert kept.manifest.inputs["name"] == "demo"
    gated(project, source)


def test_a_baseline_is_renewed_on_its_own_scenario_but_loses_no_method(project: pytest.Pytester) -> None:
    alone = RegressionGate(project.path / "out", project.path / "results/baselines")
    alone.save_baseline("mine:Mine", "own", scenario="demo")
    CHANGE["now"] = 1.1
    replaced = RegressionGate(project.path / "again", project.path / "results/baselines").save_baseline(
        "mine:Mine", "own"
    )
    assert load_results(replaced).manifest.inputs["name"] == "demo"
    says = ["harness: Baseline main also has ik, which would be lost.*"]
    gated(project, ONE.format(""), "--harness-save", says=says, failed=1)


def test_folders_are_chosen_by_options_and_runs_are_kept_apart(project: pytest.Pytester) -> None:
    (project.path / "results/baselines").rename(project.path / "kept")
    source = "\n".join(
        f"def test_{name}(harness_gate):\n    harness_gate('{name}:Mine', baseline='main', baseline_method='ik')\n"
        for name in ("one", "two")
    )
    gated(project, source, "--harness-baselines", "kept", "--harness-out", "runs", passed=2)
    assert len(list((project.path / "runs").glob("tiny-*/summary.json"))) == 2
    command = json.loads(next((project.path / "runs").glob("*/manifest.json")).read_text())["circumstances"]["command"]
    assert command.startswith("pytest test_folders")


def test_reports_are_told_every_gated_line(project: pytest.Pytester) -> None:
    CHANGE["now"] = 1.2
    gated(project, ONE.format(""), "--junit-xml", "report.xml", "-W", "error", failed=1)
    found = ElementTree.parse(project.path / "report.xml").iter("property")  # noqa: S314, it is our own
    properties = {str(item.get("name")): str(item.get("value")) for item in found}
    assert properties["harness.outcome"] == "regressed"
    for metric, unit in (("joint_angle_mean_deg", "deg"), ("mpjpe_mm", "mm"), ("jitter_m_s3", "m/s³")):
        assert properties[f"harness.{metric}.verdict"] == "worse"
        assert properties[f"harness.{metric}.difference"].endswith(unit)
        assert float(properties[f"harness.{metric}.difference"].split()[0]) > 0.0
        assert "to" in properties[f"harness.{metric}.interval"]


def test_github_is_told_beside_the_test(project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    CHANGE["now"] = 1.2
    assert "::error" not in gated(project, failed=1).stdout.str()
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    monkeypatch.setenv("GITHUB_WORKSPACE", str(project.path.parent))
    source = "def test_nothing():\n    pass\n\n" + ONE.format("")
    says = [f"::error file={project.path.name}/test_*.py,line=4,title=mpjpe_mm worse::+* mm, 95 %25 interval *"]
    result = gated(project, source, says=says, passed=1, failed=1)
    assert result.stdout.str().count("::error") == 3


VERDICTS: Mapping[str, str] = {
    "harness.outcome": "not comparable",
    "harness.why": "too few: 5%,\nof 6",
    "harness.fps[pos+ori, known].difference": "-3 frames/s",
    "harness.fps[pos+ori, known].interval": "?",
    "harness.fps[pos+ori, known].verdict": "cannot tell",
}


def test_annotations_are_escaped_as_github_reads_them() -> None:
    (warning,) = format_annotations(VERDICTS, "tests/a:b.py", 7)
    place = "file=tests/a%3Ab.py,line=7"
    assert warning == f"::warning {place},title=fps[pos+ori%2C known] cannot tell::-3 frames/s, 95 %25 interval ?"
    (error,) = format_annotations({name: VERDICTS[name] for name in ("harness.outcome", "harness.why")}, "a.py", 1)
    assert error == "::error file=a.py,line=1,title=not comparable::too few: 5%25,%0Aof 6"
    assert (
        list(format_annotations({}, "a.py", 1))
        == list(format_annotations({"harness.outcome": "pass"}, "a.py", 1))
        == []
    )


def test_a_scenario_is_read_off_a_manifest_and_only_a_runs() -> None:
    scenario = replace(load_scenario("builtin_walking"), expected_order=())
    of_it = Manifest(**json.loads(json.dumps(describe_run(asdict(scenario), motion_source="", command="").as_dict())))
    assert scenario_from_manifest(of_it) == replace(scenario, methods=(), fault=())
    with pytest.raises(BadInput, match="missing motion"):
        scenario_from_manifest(replace(of_it, inputs={"name": "a sweep"}))


def test_other_projects_pay_nothing_for_the_plugin() -> None:
    """It is loaded with every pytest, and needs no more than that has."""
    source = "import sys, pytest; before = set(sys.modules); import harness.testing.plugin\n"
    source += "print([name for name in set(sys.modules) - before if not name.startswith('harness')], pytest.__file__)"
    said = subprocess.run([sys.executable, "-c", source], capture_output=True, text=True, check=True).stdout
    assert said.startswith("[] ")
    assert Path(said.split()[-1]) == Path(pytest.__file__)


def test_a_project_without_gates_sees_no_change(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    result = gated(pytester, "def test_nothing():\n    pass\n", "-W", "error")
    assert "harness." not in result.stdout.str()
    assert "::" not in result.stdout.str()


@pytest.mark.slow
def test_a_method_is_really_run(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    """In fresh processes: kept, held to and passed, then spoilt, by pytest itself and by workers of it."""
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    monkeypatch.delenv("GITHUB_WORKSPACE", raising=False)
    method = inspect.getsource(upright)
    pytester.makepyfile(upright=method)
    pytester.path.joinpath("small.toml").write_text(SMALL)
    pytester.makepyfile(
        "def test_mine(harness_gate):\n"
        "    harness_gate('upright:Upright', baseline='own', scenario='small.toml', metrics=('mpjpe_mm',))\n"
    )
    pytester.runpytest_subprocess("--harness-save").assert_outcomes(skipped=1)
    pytester.runpytest_subprocess("-n", "1").assert_outcomes(passed=1)
    pytester.makepyfile(upright=method.replace("tpose(body.skeleton)", "9.0 + tpose(body.skeleton)"))
    result = pytester.runpytest_subprocess("-n", "1")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*B is worse than A in *", "::error file=test_*.py,line=1,title=mpjpe_mm worse::+*"])
