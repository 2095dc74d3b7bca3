"""Faults of the system and of the program: exit code 5, one line, a traceback in a file, and nothing that lies."""

import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import pytest

from harness.cli import main
from harness.commands import output
from harness.errors import Outcome
from tests.command import Command
from tests.interrupts import heeding_interrupts
from tests.planted import Plan, planted_run
from tests.short_demo import short_demo

PLAN = Plan(behaviours=("walking",), methods={"ik": 1.5, "mean_pose": 14.0}, takes=2, duration_s=1.5)
PROGRAM = [sys.executable, "-m", "harness"]


def run(
    *words: str,
    cwd: Path,
    stdout: int | None = subprocess.PIPE,
    prepare: Callable[[], None] | None = None,
    temporary: Path | None = None,
) -> subprocess.CompletedProcess[str]:
    """The real program, with a temporary folder of its own."""
    folder = temporary or cwd / "temporary"
    folder.mkdir(exist_ok=True)
    kept = {name: value for name, value in os.environ.items() if name != "HARNESS_MOCAP"}
    return subprocess.run(
        [*PROGRAM, *words],
        cwd=cwd,
        env={**kept, "TMPDIR": str(folder)},
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=prepare,
    )


def limit_files(size: int) -> Callable[[], None]:
    """No file of the program may grow beyond so many bytes, as on a disk that is nearly full."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def assert_failed(ended: subprocess.CompletedProcess[str], cause: str) -> str:
    """The one line of a fault, after looking at all that is promised of it."""
    (line,) = [line for line in ended.stderr.splitlines() if line.startswith("harness:")]
    assert ended.returncode == 5, ended.stderr
    assert "Traceback" not in ended.stderr
    assert line.startswith("harness: failed: ")
    assert cause in line
    found = re.search(r"\(traceback: (.+)\)$", line)
    assert found, line
    assert "Traceback (most recent call last)" in Path(found.group(1)).read_text()
    return line


def failing(fault: BaseException) -> Callable[..., NoReturn]:
    """A function that raises this."""

    def fail(*given: object, **named: object) -> NoReturn:
        raise fault

    return fail


def start(verb: str, before: str, cwd: Path, **options: Any) -> subprocess.CompletedProcess[str]:
    """The program's own entry, after some lines of code that change what it meets."""
    code = f"import sys\nimport harness.__main__ as program\n{before}\nsys.argv = ['harness', {verb!r}]\n"
    return subprocess.run(
        [sys.executable, "-c", f"{code}sys.exit(program.main())"], cwd=cwd, capture_output=True, text=True, **options
    )


def test_the_word_and_the_code_of_a_fault_are_no_verdict() -> None:
    assert (Outcome.FAILED.exit_code, Outcome.FAILED.word) == (5, "failed")
    assert [outcome for outcome in Outcome if outcome.exit_code == 1] == [Outcome.REGRESSED]


@pytest.mark.parametrize("words", [["list"], ["list", "--json"], ["--help"]])
def test_a_result_that_cannot_be_printed_is_a_fault(words: list[str], tmp_path: Path) -> None:
    with open("/dev/full", "w") as full:
        ended = run(*words, cwd=tmp_path, stdout=full.fileno())
    assert_failed(ended, "The result cannot be printed (No space left on device)")


def test_messages_that_nobody_can_read_stop_nothing(tmp_path: Path) -> None:
    command = [*PROGRAM, "lst"]
    with open("/dev/full", "w") as full:
        ended = subprocess.run(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=full, text=True)
    assert (ended.returncode, ended.stdout) == (2, "refused\n")


def test_a_closed_stdout_is_no_fault(tmp_path: Path) -> None:
    ended = run("list", cwd=tmp_path, stdout=None, prepare=lambda: os.close(1))
    assert (ended.returncode, ended.stderr.splitlines()[1:]) == (0, ["next: harness demo"])


def test_a_reader_who_leaves_does_not_change_the_exit_code(tmp_path: Path) -> None:
    """`harness status DIR | head -1`: quiet, and still `incomplete`."""
    out = planted_run(tmp_path / "run", replace(PLAN, failing=("ik",)))
    reader, writer = os.pipe()
    os.close(reader)
    ended = run("status", str(out), cwd=tmp_path, stdout=writer)
    os.close(writer)
    assert (ended.returncode, ended.stderr.splitlines()[1:]) == (4, [])


def test_a_working_folder_that_is_gone_is_a_fault(tmp_path: Path) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()

    def leave(**options: object) -> None:
        os.chdir(gone)
        gone.rmdir()

    ended = run("list", "--json", cwd=tmp_path, prepare=leave)
    line = assert_failed(ended, "The working directory no longer exists")
    content = json.loads(ended.stdout)
    assert content["outcome"] == "failed"
    assert content["error"] in line


@pytest.mark.long
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_full_disk_ends_a_run_which_goes_on_later(jobs: str, tmp_path: Path) -> None:
    scenario = short_demo(tmp_path / "short.toml")
    scenario.write_text(scenario.read_text().replace("longest_s = 2.0", "longest_s = 6.0"))
    words = ("run", "short.toml", "--methods", "mean_pose", "--no-report", "--out", "out", "--jobs", jobs)
    # The frames of a cell are larger, the index is smaller: SQLite has another text.
    ended = run(*words, cwd=tmp_path, prepare=limit_files(200_000))
    line = assert_failed(ended, "out cannot be written (File too large). ")
    assert ended.stdout == "failed\n"
    assert "0 of 5 cells in out are finished and kept. Free some disk space, then give the same command again." in line
    assert not list((tmp_path / "out").rglob(".unfinished-*"))
    again = run(*words, cwd=tmp_path)
    assert (again.returncode, again.stdout.splitlines()[-1]) == (0, "pass"), again.stderr


def test_a_folder_that_cannot_be_written_is_a_fault_and_a_file_in_its_place_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    short_demo(tmp_path / "short.toml")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    words = ["run", "short.toml", "--methods", "mean_pose", "--no-report", "--out"]
    command(*words, "file", code=2)
    command(*words, "file/below", code=2)

    def refuse(path: Path, *given: object, **named: object) -> None:
        raise OSError(30, "Read-only file system", str(path))

    monkeypatch.setattr(Path, "mkdir", refuse)
    said = command(*words, "new", code=5)
    assert said.out == "failed\n"
    assert "Read-only file system (new)" in said.err
    assert "Name a place that can be written" in said.err


def test_a_folder_that_vanishes_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """A method takes it away between two of its clips."""
    short_demo(tmp_path / "short.toml")
    (tmp_path / "taking.py").write_text(
        "import shutil\n"
        "from dataclasses import dataclass\n"
        "from harness.reconstruct.methods.mean_pose import MeanPose\n"
        "@dataclass(frozen=True)\n"
        "class Taking(MeanPose):\n"
        "    def fit(self, body, examples, rng):\n"
        f"        shutil.rmtree({str(tmp_path / 'out')!r})\n"
        "        return super().fit(body, examples, rng)\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    assert main(["run", "short.toml", "--methods", "taking:Taking", "--no-report", "--out", "out"]) == 5
    said = capfd.readouterr()
    assert said.out == "failed\n"
    assert "The folder out vanished. Nothing is kept in out. Something was removed" in said.err
    assert not (tmp_path / "out").exists()


def test_a_defect_of_the_program_is_a_fault(monkeypatch: pytest.MonkeyPatch, command: Command, tmp_path: Path) -> None:
    fault = TypeError("two\nlines " + 1000 * "x")
    monkeypatch.setattr("harness.commands.catalogue.build_catalogue", failing(fault))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    said = command("list", "--json", code=5)
    assert json.loads(said.out)["outcome"] == "failed"
    assert said.err.count("\n") == 1
    assert "a defect of the program (TypeError: two lines xxx" in said.err
    assert len(said.err) < 700
    (saved,) = tmp_path.glob("harness-traceback-*.txt")
    assert str(saved) in said.err
    assert "TypeError: two\nlines" in saved.read_text()


@pytest.mark.parametrize(
    ("fault", "broken", "told"),
    [
        (SystemExit(1), "", "asked to exit with 1"),
        (BrokenPipeError(32, "Broken pipe"), "", "Broken pipe"),  # inside the program: no reader who left
        (OSError(28, "No space left on device"), "mkstemp", "(the traceback could not be saved (No space left"),
    ],
)
def test_a_fault_inside_the_program_chooses_neither_code_nor_silence(
    fault: BaseException, broken: str, told: str, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    monkeypatch.setattr("harness.commands.catalogue.build_catalogue", failing(fault))
    if broken:
        monkeypatch.setattr(tempfile, broken, failing(fault))
    assert told in command("list", code=5).err


def test_a_full_disk_ends_a_recording_and_keeps_what_came_before(tmp_path: Path) -> None:
    short_demo(tmp_path / "short.toml")
    ended = run("record", "sim:short.toml", "out.is900", cwd=tmp_path, prepare=limit_files(10_000))
    line = assert_failed(ended, "out.is900 cannot be written (File too large)")
    assert "Blocks that were recorded before are kept" in line
    assert run("replay", "out.is900", "--speed", "max", cwd=tmp_path).returncode == 0


def test_a_baseline_that_cannot_be_moved_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:

    planted_run(tmp_path / "run", PLAN)
    monkeypatch.chdir(tmp_path)
    command("baseline", "save", "one", "run")
    folder = tmp_path / "results" / "baselines"
    before = {path.name: path.read_bytes() for path in (folder / "one").iterdir()}

    monkeypatch.setattr("harness.compare.baseline.move_into_place", failing(OSError(28, "No space left on device")))
    assert "Free some disk space" in command("baseline", "save", "one", "run", "--force", code=5).err
    assert {path.name: path.read_bytes() for path in (folder / "one").iterdir()} == before
    assert [path.name for path in folder.iterdir()] == ["one"]


def test_a_folder_that_is_read_only_can_be_looked_at(tmp_path: Path) -> None:
    """A mount is needed, because the superuser writes where permissions forbid it."""
    out = planted_run(tmp_path / "run", PLAN)
    mount = shutil.which("mount")
    bind = mount and subprocess.run([mount, "--bind", out, out], capture_output=True).returncode == 0
    if not bind or not mount:
        pytest.skip("this process may not mount")
    try:
        subprocess.run([mount, "-o", "remount,bind,ro", out], check=True)
        seen = run("status", "run", cwd=tmp_path)
        assert (seen.returncode, seen.stdout.splitlines()[-1]) == (0, "pass"), seen.stderr
        assert_failed(run("report", "run", cwd=tmp_path), "Read-only file system")
    finally:
        subprocess.run(["umount", out], check=True)  # noqa: S607


def test_data_are_printed_whole(capsys: pytest.CaptureFixture[str]) -> None:
    assert output.print_data("a\n")
    assert capsys.readouterr().out == "a\n"


def test_a_thread_that_hangs_does_not_keep_the_program(tmp_path: Path) -> None:
    """Signals are ignored after the last line, so nothing else could end it."""
    hang = "import threading, time\nprogram.END_S = 0.5\nthreading.Thread(target=time.sleep, args=(600.0,)).start()"
    ended = start("lst", hang, tmp_path, timeout=120.0)
    assert (ended.returncode, ended.stdout) == (2, "refused\n")


def test_a_broken_installation_is_a_fault(tmp_path: Path) -> None:
    ended = start("list", "sys.modules['harness.cli'] = None", tmp_path, env={**os.environ, "TMPDIR": str(tmp_path)})
    assert_failed(ended, "a defect of the program (ModuleNotFoundError")
    assert ended.stdout == "failed\n"


def test_ctrl_c_while_the_program_loads_prints_nothing(tmp_path: Path) -> None:
    """It was a traceback of the imports until the signals were handled."""
    stop = (
        "import os, signal\n"
        "class Interrupted:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'harness.core.interrupts':\n"
        "            os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Interrupted())"
    )
    ended = start("list", stop, tmp_path, preexec_fn=heeding_interrupts)
    assert (ended.returncode, ended.stdout, ended.stderr) == (-signal.SIGINT, "", "")
