"""`action.yml`: its commands are executed as GitHub does it; `gh` and `python` only note what they are given."""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from tests.planted import MeansPlan, planted_means_run
from tests.products import run_verb

ACTION = Path(__file__).parents[1] / "action.yml"
METHOD, CLIPS = "ik:previous", 8
METRICS = "joint_angle_mean_deg,mpjpe_mm"
NOTE = """#!{python}
import json, pathlib, sys
body = next((word.partition("@")[2] for word in sys.argv if word.startswith("body=@")), "")
with open({calls!r}, "a") as file:
    print(json.dumps([sys.argv[1:], pathlib.Path(body).read_text() if body else ""]), file=file)
print({answer!r}, end="")
"""


class Runner:
    """Executes the steps of the action in a folder."""

    def __init__(self, folder: Path, inputs: Mapping[str, str], answer: str = "") -> None:
        self.folder, self.calls = folder, folder / "calls.jsonl"
        content: dict[str, Any] = pytest.importorskip("yaml").safe_load(ACTION.read_text("utf-8"))
        self.steps: list[dict[str, Any]] = content["runs"]["steps"]
        self.values = {
            **{f"inputs.{name}": str(each.get("default", "")) for name, each in content["inputs"].items()},
            **{f"inputs.{name}": value for name, value in inputs.items()},
            "inputs.token": "secret",
            "github.action_path": "/the/action",
            "github.event.pull_request.number": "7",
        }
        tools = folder / "tools"
        tools.mkdir()
        for name in ("gh", "python"):
            note = NOTE.format(python=sys.executable, calls=str(self.calls), answer=answer if name == "gh" else "")
            (tools / name).write_text(note)
            (tools / name).chmod(0o755)
        self.path = f"{tools}:{Path(sys.executable).parent}:{os.environ['PATH']}"

    def step(self, name: str) -> int:
        """The exit code of a step."""
        (step,) = [each for each in self.steps if each.get("name") == name]
        files = {
            key: str(self.folder / key)
            for key in ("GITHUB_OUTPUT", "GITHUB_STEP_SUMMARY", "RUNNER_TEMP", "GITHUB_REPOSITORY")
        }
        Path(files["RUNNER_TEMP"]).mkdir(exist_ok=True)
        own = {key: self.resolve(value) for key, value in step.get("env", {}).items()}
        done = subprocess.run(
            [shutil.which("bash") or "bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]],
            cwd=self.folder,
            env={**os.environ, **files, "GITHUB_REPOSITORY": "me/mine", "PATH": self.path, **own},
            capture_output=True,
            text=True,
        )
        assert not re.search(r"unbound variable|syntax error|not found", done.stderr), done.stderr
        return done.returncode

    def resolve(self, text: str) -> str:
        def value(match: re.Match[str]) -> str:
            return self.output("code") if match[1].startswith("steps.") else self.values[match[1]]

        return re.sub(r"\$\{\{ (\S+) \}\}", value, text)

    def output(self, name: str) -> str:
        lines = (self.folder / "GITHUB_OUTPUT").read_text().splitlines()
        return next(line.partition("=")[2] for line in lines if line.startswith(f"{name}="))

    def called(self) -> list[tuple[list[str], str]]:
        """The words and the body of each call of a tool."""
        return [(words, body) for words, body in map(json.loads, self.calls.read_text().splitlines())]


@pytest.fixture(scope="module")
def baselines(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scenario, a baseline of it that errs by half a degree, and one as its method really errs."""
    folder = tmp_path_factory.mktemp("action")
    plan = MeansPlan(("walking",), CLIPS, {METHOD: 0.5})
    planted = planted_means_run(folder / "planted", plan)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        run_verb("run", folder / "planted.toml", "--out", "real", "--no-report")
        run_verb("baseline", "save", "better", planted)
        run_verb("baseline", "save", "today", "real")
    return folder


def runner(folder: Path, baselines: Path, baseline: str, answer: str = "", **inputs: str) -> Runner:
    (folder / "results").symlink_to(baselines / "results")
    given = {"scenario": str(baselines / "planted.toml"), "baseline": baseline, "metrics": METRICS, **inputs}
    return Runner(folder, given, answer)


@pytest.mark.long
def test_a_gate_that_passes_writes_the_tables_and_edits_its_comment(baselines: Path, tmp_path: Path) -> None:
    gate = runner(tmp_path, baselines, "today", answer="41\n")
    assert gate.step("Run and compare") == 0
    assert gate.output("code") == "0"
    summary = (tmp_path / "GITHUB_STEP_SUMMARY").read_text()
    assert "| metric | method | clips | baseline | now |" in summary
    assert "B is no worse than A in 2 gated lines on 8 performers" in summary
    assert gate.step("Comment") == 0
    (listed, _), (edited, body) = gate.called()
    assert listed[:3] == ["api", "--paginate", "repos/me/mine/issues/7/comments"]
    assert edited[:5] == ["api", "--silent", "--method", "PATCH", "repos/me/mine/issues/comments/41"]
    assert body.startswith("<!-- harness gate ")
    assert body.endswith(summary)
    assert gate.step("Outcome") == 0


@pytest.mark.long
def test_a_gate_that_regresses_fails_after_its_comment(baselines: Path, tmp_path: Path) -> None:
    gate = runner(tmp_path, baselines, "better", methods=f"{METHOD}\n")
    assert gate.step("Run and compare") == 0
    assert "B is worse than A in 2 of 2 gated lines" in (tmp_path / "GITHUB_STEP_SUMMARY").read_text()
    assert gate.step("Comment") == 0
    words, body = gate.called()[-1]
    assert words[:5] == ["api", "--silent", "--method", "POST", "repos/me/mine/issues/7/comments"]
    assert "✗ worse" in body
    assert gate.step("Outcome") == 1


@pytest.mark.long
def test_a_gate_without_its_baseline_says_so(baselines: Path, tmp_path: Path) -> None:
    gate = runner(tmp_path, baselines, "yesterday", methods="mean_pose ik:previous[jump_m=0.2]")
    assert gate.step("Run and compare") == 0
    assert "no folder or baseline called 'yesterday'" in (tmp_path / "GITHUB_STEP_SUMMARY").read_text()
    assert gate.step("Outcome") == 2


def test_the_checkout_or_a_version_is_installed(tmp_path: Path) -> None:
    for version, installed in (("", "/the/action"), ("0.1.0", "tracker-harness==0.1.0")):
        folder = tmp_path / (version or "checkout")
        folder.mkdir()
        gate = Runner(folder, {"version": version})
        assert gate.step("Install") == 0
        assert gate.called() == [(["-m", "pip", "install", "--quiet", installed], "")]
