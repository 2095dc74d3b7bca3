"""Child processes end with the program, and their end is noticed although another process holds their pipes."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from harness.core.child_process import FunctionProcess, PythonProcess, run_python
from tests.processes import is_running, wait_until

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are found in /proc")
SLEEP = "import time; time.sleep(600)"


def holds_the_pipe(pipe: Any, escape: bool) -> None:
    """Leave a process that holds the pipe, say its number, and crash."""
    child = os.fork()
    if child == 0:
        if escape:
            os.setsid()
        time.sleep(600)
    pipe.send(child)
    os.kill(os.getpid(), signal.SIGSEGV)


@pytest.mark.parametrize("escape", [False, True], ids=["in its group", "in a session of its own"])
def test_a_crash_is_noticed_although_a_child_holds_the_pipe(escape: bool) -> None:
    process = FunctionProcess(holds_the_pipe, escape)
    child = process.receive(60.0)
    try:
        began = time.monotonic()
        with pytest.raises(EOFError):
            process.receive(60.0)
        assert time.monotonic() - began < 10.0
        assert process.exit_code == -signal.SIGSEGV
        if not escape:
            wait_until(lambda: not is_running(child))
    finally:
        if escape:
            os.kill(child, signal.SIGKILL)
        process.close()


def waits_for_the_end(pipe: Any) -> None:
    pipe.send("ready")
    pipe.poll(None)


def test_the_end_is_noticed_although_a_thread_reads_here() -> None:
    """A pipe that is only closed stays open as long as a thread reads from it."""
    process = FunctionProcess(waits_for_the_end)
    assert process.receive(60.0) == "ready"
    ended: list[BaseException] = []

    def read() -> None:
        try:
            process.receive()
        except EOFError as error:
            ended.append(error)

    reader = Thread(target=read)
    reader.start()
    time.sleep(0.2)
    process.close(30.0)
    reader.join(10.0)
    assert (process.exit_code, len(ended)) == (0, 1)


def test_a_silent_process_is_no_longer_waited_for() -> None:
    process = FunctionProcess(waits_for_the_end)
    assert process.receive(60.0) == "ready"
    with pytest.raises(TimeoutError):
        process.receive(0.05)
    process.close()
    assert process.exit_code == -signal.SIGKILL


PROGRAM = """
import os, sys, time
from harness.core.child_process import FunctionProcess, PythonProcess
from tests.core.test_child_process import says_its_number
if __name__ == "__main__":
    if sys.argv[1] == "function":
        process = FunctionProcess(says_its_number)
        print(process.receive(60.0), process._temporary.name, flush=True)
    else:
        process = PythonProcess("tests.core.sleeper", stdout=-1)
        print(process.stdout.readline().strip(), process._temporary.name, flush=True)
    if os.fork() == 0:
        time.sleep(60.0)  # it holds whatever this program had open
    time.sleep(600.0)
"""


def says_its_number(pipe: Any) -> None:
    pipe.send(os.getpid())
    time.sleep(600)


@pytest.mark.parametrize("kind", ["function", "module"])
def test_a_child_ends_with_a_program_that_is_killed(kind: str, tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(PROGRAM)
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    with subprocess.Popen(
        [sys.executable, str(tmp_path / "program.py"), kind],
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
        start_new_session=True,
    ) as program:
        assert program.stdout is not None
        child, temporary = program.stdout.readline().split()
        try:
            assert is_running(int(child))
            assert Path(temporary).is_dir()
            program.kill()
            wait_until(lambda: not is_running(int(child)))
            assert not Path(temporary).exists()
        finally:
            os.killpg(program.pid, signal.SIGKILL)


def test_what_a_program_prints_is_returned_and_its_failure_told() -> None:
    assert run_python("calendar", "2026", "11").split()[:2] == ["November", "2026"]
    with pytest.raises(RuntimeError, match="No module named no_such_module"):
        run_python("no_such_module")


@pytest.mark.parametrize("escape", [False, True], ids=["in its group", "in a session of its own"])
def test_the_end_of_a_program_is_noticed_although_a_child_holds_its_streams(
    escape: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = ", start_new_session=True" if escape else ""
    (tmp_path / "crashes.py").write_text(
        f"import os, subprocess, sys\nchild = subprocess.Popen([sys.executable, '-c', {SLEEP!r}]{options})\n"
        "print(child.pid, file=sys.stderr, flush=True)\nos._exit(3)\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    began = time.monotonic()
    with PythonProcess("crashes") as process:
        ended = process.finish(60.0)
    assert ended is not None
    child = int(ended[1])
    assert time.monotonic() - began < 30.0
    assert process.returncode == 3
    if escape:
        os.kill(child, signal.SIGKILL)
    wait_until(lambda: not is_running(child))


def test_a_program_that_hangs_is_killed_with_its_group(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "hangs.py").write_text(
        f"import subprocess, sys, time\nchild = subprocess.Popen([sys.executable, '-c', {SLEEP!r}])\n"
        "open(sys.argv[1], 'w').write(str(child.pid))\ntime.sleep(600)\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    mark, looks = tmp_path / "mark", list[int]()
    with PythonProcess("hangs", str(mark)) as process:
        wait_until(lambda: mark.exists() and bool(mark.read_text()))
        assert process.finish(1.0, lambda: looks.append(1)) is None
    assert looks
    wait_until(lambda: not is_running(int(mark.read_text())))
    assert not Path(process._temporary.name).exists()
