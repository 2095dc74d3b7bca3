"""The command line as a user meets it: words, exit codes, one error line, nothing written over."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from harness.cli import build_parser, main
from harness.commands.flags import repeat_flags
from harness.commands.run import _named_methods
from harness.reconstruct import list_methods
from tests.command import Command
from tests.short_demo import short_demo


def run(*words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """The real program in its own process, without a library of real motion."""
    environment = {k: v for k, v in os.environ.items() if k != "HARNESS_MOCAP"}
    return subprocess.run(
        [sys.executable, "-m", "harness.cli", *words], cwd=cwd, env=environment, capture_output=True, text=True
    )


def test_help_names_every_verb_and_each_has_a_file(command: Command) -> None:
    verbs = {line.split()[0] for line in re.findall(r"^  [a-z]+\s.*", command("--help").out, re.MULTILINE)}
    files = (Path(__file__).parents[1] / "harness" / "commands").glob("*.py")
    assert verbs == {path.stem for path in files if f"\ndef add_{path.stem}(verbs: Verbs)" in path.read_text()}
    assert {"demo", "run", "list", "inspect", "validate", "status"} < verbs


def test_help_imports_nothing_heavy() -> None:
    code = "import sys, harness.cli as c; c.build_parser(); print(sorted({m.split('.')[0] for m in sys.modules}))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    for heavy in ("numpy", "scipy", "mujoco", "matplotlib", "pyvista"):
        assert f"'{heavy}'" not in loaded


def test_a_verb_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    ended = run("rn", cwd=tmp_path)
    assert ended.returncode == 2
    assert ended.stderr.startswith("harness: no verb called 'rn'. Did you mean 'run'? Known: demo, ")
    assert ended.stderr.count("\n") == 1
    assert ended.stdout.strip() == "refused"


def test_a_verb_says_that_it_loads_before_the_first_large_library(tmp_path: Path) -> None:
    command = [sys.executable, "-P", "-X", "importtime", "-m", "harness", "list", "inputs"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    lines = done.stderr.splitlines()
    libraries = [place for place, line in enumerate(lines) if re.search(r"\| +(numpy|scipy|mujoco|numba)$", line)]
    assert libraries
    (said,) = [place for place, line in enumerate(lines) if line.startswith("list: loading")]
    assert said < min(libraries)


def test_real_motion_is_never_replaced_by_built_in(tmp_path: Path) -> None:
    ended = run("run", "boxing", cwd=tmp_path)
    assert ended.returncode == 2
    assert "--mocap" in ended.stderr
    assert ended.stdout.strip() == "refused"
    assert not list(tmp_path.iterdir())


def test_errors_are_json_when_json_is_asked_for(tmp_path: Path) -> None:
    ended = run("run", "boxin", "--json", cwd=tmp_path)
    assert ended.returncode == 2
    said = json.loads(ended.stdout)
    assert said["outcome"] == "refused"
    assert "boxing" in said["error"]


@pytest.mark.long
def test_all_methods_are_the_scenario_s_and_every_other_one() -> None:
    own = ("ik", "local_pca+ik")
    assert _named_methods("mean_pose,ik[prior_sigma_rad=0.5|0.6]", own) == (
        *("mean_pose", "ik[prior_sigma_rad=0.5]", "ik[prior_sigma_rad=0.6]"),
    )
    named = _named_methods("all,mine:Mine,ik", own)
    assert named[:2] == own
    assert named[-1] == "mine:Mine"
    assert set(named) == {*own, *list_methods(), "mine:Mine"}
    assert len(set(named)) == len(named)


def test_what_a_method_prints_is_talk_and_its_interrupt_a_failed_cell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Also when it is a worker that prints."""
    (tmp_path / "noisy.py").write_text(
        "from dataclasses import dataclass\n"
        "from harness.reconstruct.methods.mean_pose import MeanPose\n"
        "@dataclass(frozen=True)\n"
        "class Chatty(MeanPose):\n"
        "    def fit(self, body, examples, rng):\n"
        "        print('hello')\n"
        "        return super().fit(body, examples, rng)\n"
        "@dataclass(frozen=True)\n"
        "class Stopped(MeanPose):\n"
        "    def fit(self, body, examples, rng):\n"
        "        raise KeyboardInterrupt\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    short = str(short_demo(tmp_path / "short.toml"))
    for jobs in ("1", "2"):
        words = ("--methods", "noisy:Chatty", "--no-report", "--json", "--jobs", jobs, "--out", f"chatty{jobs}")
        assert main(["run", short, *words]) == 0
        said, talk = capfd.readouterr()
        assert json.loads(said)["outcome"] == "pass"
        assert "hello" in talk
    assert main(["run", short, "--methods", "noisy:Stopped", "--no-report", "--json", "--out", "stopped"]) == 4
    assert json.loads(capfd.readouterr().out)["outcome"] == "incomplete"


@pytest.mark.long
def test_characters_that_the_output_cannot_encode_are_escaped(tmp_path: Path) -> None:
    command = [sys.executable, "-P", "-m", "harness", "list", "metrics"]
    environment = {**os.environ, "PYTHONIOENCODING": "ascii:strict"}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert r"[m/s\xb3]" in done.stdout


def test_output_into_a_closed_pipe_ends_quietly(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "harness.cli", "list"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        assert program.stderr is not None
        program.stdout.close()
        said = program.stderr.read()
    assert re.fullmatch("list: loading.*\n", said)
    assert program.returncode == 0


@pytest.mark.parametrize(
    "verb", ["emulate demo --pty link", "live --port none --scenario demo", "record sim:demo a.rec", "run demo"]
)
def test_ctrl_c_while_a_verb_starts_is_an_interrupt_also_where_it_is_the_normal_end(
    verb: str, monkeypatch: pytest.MonkeyPatch, command: Command, tmp_path: Path
) -> None:
    def interrupted(*given: object, **named: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    for where in ("harness.experiment.playback.prepare_playback", "harness.experiment.engine.run"):
        monkeypatch.setattr(where, interrupted)
    said = command(*verb.split(), code=130)
    assert "stopped" in said.out + said.err


def test_mocap_may_be_given_more_than_once() -> None:
    parse = build_parser().parse_args
    assert parse(["run", "demo"]).mocap is None
    assert parse(["run", "demo", "--mocap", "a"]).mocap == Path("a")
    assert parse(["run", "demo", "--mocap", "a", "--mocap", "b", "--mocap", "c"]).mocap == tuple(map(Path, "abc"))
    for folders in ([], ["--mocap", "a"], ["--mocap", "a", "--mocap", "b"]):
        assert repeat_flags(parse(["run", "demo", *folders]), "mocap") == folders


def test_demo_has_all_options_of_run() -> None:
    """The demo says what it does and is a run then."""
    demo, run = (vars(build_parser().parse_args(words)) for words in (["demo"], ["run", "demo"]))
    assert demo.keys() == run.keys()
    differing = {name for name in run if demo[name] != run[name]} - {"verb"}
    assert differing <= {"jobs", "action"}


def test_the_package_is_a_program(tmp_path: Path) -> None:
    ended = subprocess.run(
        [sys.executable, "-m", "harness", "--version"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert ended.stdout.startswith("harness ")


@pytest.mark.parametrize("module", ["fcntl", "termios", "tty", "pwd", "grp", "resource", "pty"])
def test_start_up_needs_no_module_of_posix(module: str) -> None:
    """As on Windows, where these do not exist."""
    code = f"import sys; sys.modules[{module!r}] = None; import harness.cli as c; c.build_parser()"
    subprocess.run([sys.executable, "-c", code], check=True)
