"""The process of a method ends with everything that it started, and its end is noticed at once."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from harness.errors import BadFile, SystemFault
from harness.experiment.methods.isolation import Isolation
from harness.experiment.methods.method_process import MethodFailure, MethodProcess
from harness.experiment.methods.remote_method import RemoteMethod
from harness.experiment.methods.worker_process import close_fork_server
from tests.processes import is_running, wait_until

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(sys.platform != "linux", reason="workers are forked on Linux alone"),
]
UPRIGHT = Path(__file__).parents[1] / "testing" / "upright.py"
MODULE = """
import os, signal, time
from pathlib import Path
from upright import Upright


def leave_a_process(escape):
    if (child := os.fork()) == 0:
        if escape == "group":
            os.setpgid(0, 0)
        if escape == "session":
            os.setsid()
        if escape == "orphan":
            os.setsid()
            if os.fork():
                os._exit(0)
        Path({mark!r}).write_text(str(os.getpid()))
        time.sleep(600)
    while not Path({mark!r}).exists():
        time.sleep(0.01)


class Leaves(Upright):
    def __init__(self):
        super().__init__()
        if not Path({mark!r}).exists():
            leave_a_process({escape!r})
            {then}
"""
ESCAPES = ["", "group", "session", "orphan"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder on the import path, where methods can be written."""
    monkeypatch.syspath_prepend(tmp_path)
    shutil.copy(UPRIGHT, tmp_path)
    return tmp_path


@pytest.fixture(autouse=True, scope="module")
def end_server() -> Iterator[None]:
    yield
    close_fork_server()


def leaving_method(folder: Path, escape: str, then: str, limit_s: float = 120.0) -> tuple[RemoteMethod, Path]:
    """A method that leaves a process behind when it is made, and the file with the number of that process."""
    mark = folder / "mark"
    (folder / "leaves.py").write_text(MODULE.format(escape=escape, mark=str(mark), then=then))
    name = "leaves:Leaves"
    return RemoteMethod(name, MethodProcess(name, Isolation(time_limit_s=limit_s))), mark


def read_number(mark: Path) -> int:
    wait_until(lambda: mark.exists() and bool(mark.read_text()))
    return int(mark.read_text())


@pytest.mark.parametrize("escape", ESCAPES)
def test_a_crash_is_noticed_at_once_although_a_child_holds_the_streams(folder: Path, escape: str) -> None:
    method, mark = leaving_method(folder, escape, "os.abort()")
    began = time.monotonic()
    with pytest.raises(MethodFailure, match="SIGABRT"):
        method.describe()
    assert time.monotonic() - began < 60.0
    wait_until(lambda: not is_running(read_number(mark)))


@pytest.mark.parametrize("escape", ESCAPES)
def test_what_a_method_started_ends_at_the_limit(folder: Path, escape: str) -> None:
    method, mark = leaving_method(folder, escape, "time.sleep(600)", limit_s=5.0)
    began = time.monotonic()
    with pytest.raises(MethodFailure, match="gave no answer within 5 s"):
        method.describe()
    assert time.monotonic() - began < 60.0
    wait_until(lambda: not is_running(read_number(mark)))


@pytest.mark.parametrize("escape", ESCAPES)
def test_what_a_method_started_ends_when_its_process_is_closed(folder: Path, escape: str) -> None:
    method, mark = leaving_method(folder, escape, "pass")
    assert method.describe().summary
    assert is_running(read_number(mark))
    method.process.close()
    wait_until(lambda: not is_running(read_number(mark)))


PROGRAM = """
import os, sys, time
from pathlib import Path
from tests.experiment.test_method_process import leaving_method
sys.path.insert(0, sys.argv[1])
method, _ = leaving_method(Path(sys.argv[1]), "orphan", "time.sleep(600)")
if os.fork() == 0:
    time.sleep(60.0)
method.process.start()
if os.fork() == 0:
    time.sleep(60.0)  # it holds what this program has open
method.describe()
"""


def test_what_a_method_started_ends_when_the_program_is_killed(folder: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    with subprocess.Popen([sys.executable, "-c", PROGRAM, str(folder)], env=environment, start_new_session=True) as it:
        try:
            child = read_number(folder / "mark")
            assert is_running(child)
            it.kill()
            wait_until(lambda: not is_running(child))
        finally:
            os.killpg(it.pid, signal.SIGKILL)


def test_a_process_that_cannot_import_the_harness_is_no_fault_of_the_method(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python runs `sitecustomize` first; this one breaks a module in every process that is started."""
    (folder / "broken").mkdir()
    (folder / "broken" / "sitecustomize.py").write_text("import sys\nsys.modules['harness.core.messages'] = None\n")
    monkeypatch.setenv("PYTHONPATH", str(folder / "broken"))
    close_fork_server()
    name = "upright:Upright"
    try:
        with pytest.raises(SystemFault, match="No process can be started for a method"):
            RemoteMethod(name, MethodProcess(name, Isolation())).describe()
    finally:
        close_fork_server()


def test_a_process_that_ends_before_it_has_seen_the_method_is_no_fault_of_the_method(folder: Path) -> None:
    process = MethodProcess("upright:Upright", Isolation(), "calendar")  # a module without `main` for descriptors
    with pytest.raises(SystemFault, match="was not loaded yet"):
        RemoteMethod("upright:Upright", process).describe()


@pytest.mark.parametrize("error", ["OSError(28, 'No space left on device')", "OSError(5, 'Input/output error')"])
def test_a_full_disk_is_no_fault_of_the_method(folder: Path, error: str) -> None:
    (folder / "writes.py").write_text(
        f"from upright import Upright\nclass Writes(Upright):\n    def __init__(self):\n        raise {error}\n"
    )
    name = "writes:Writes"
    process = MethodProcess(name, Isolation())
    with closing(process), pytest.raises(SystemFault, match=r"No space left|Input/output error"):
        RemoteMethod(name, process).describe()


def make_special_file(path: Path, kind: str) -> None:
    if kind == "a FIFO":
        os.mkfifo(path)
    else:
        path.symlink_to("/dev/zero")


@pytest.mark.parametrize("kind", ["a FIFO", "a device"])
@pytest.mark.parametrize("place", ["weights", "tables/weights"])
def test_a_declared_file_that_is_no_regular_file_is_refused(folder: Path, kind: str, place: str) -> None:
    (folder / "tables").mkdir()
    make_special_file(folder / place, kind)
    declared = place.partition("/")[0]
    (folder / "reads.py").write_text(
        f"from upright import Upright\nclass Reads(Upright):\n    files = [{declared!r}]\n"
    )
    name = "reads:Reads"
    process = MethodProcess(name, Isolation(time_limit_s=60.0))
    with closing(process), pytest.raises(BadFile, match=f"{kind}, not a regular file") as caught:
        RemoteMethod(name, process).describe()
    assert "\n" not in str(caught.value)
