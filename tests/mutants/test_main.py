"""The command: draws that test nothing, the summary, and the end after a signal."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.interrupts import heeding_interrupts
from tests.mutants import __main__ as command
from tests.mutants.campaign import RedReference, Result, run_campaign
from tests.mutants.equivalent import Equivalent
from tests.mutants.operators import Mutation, mutations
from tests.mutants.process_groups import ProcessGroups, Stopped
from tests.mutants.test_campaign import MODULE, ROOT, SOURCE, small_checkout

POSSIBLE = mutations(MODULE, SOURCE)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A package of two lines that can be mutated, without equivalent mutations."""
    monkeypatch.setattr(command, "all_mutations", lambda root: POSSIBLE)
    monkeypatch.setattr(command, "read_equivalents", list)


def no_campaign(*args: object, **options: object) -> list[Result]:
    raise AssertionError("nothing is to be tested")


@pytest.mark.parametrize("option", ["--count=0", "--count=-3", "--jobs=0", "--jobs=-1", "--jobs=two"])
def test_counts_are_positive(option: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        command.main([option])
    assert f"{option.partition('=')[2]!r} is not a positive whole number" in capsys.readouterr().err


@pytest.mark.usefixtures("small")
def test_a_path_of_no_mutation_is_refused(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(command, "run_campaign", no_campaign)
    assert command.main(["--under", "harness/scroe"]) == 2
    (message,) = capsys.readouterr().err.splitlines()
    assert "--under harness/scroe" in message


@pytest.mark.usefixtures("small")
def test_a_draw_of_equivalent_mutations_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    listed = [Equivalent(m.file, m.operator, m.line, m.mutant, "no reader") for m in POSSIBLE]
    monkeypatch.setattr(command, "read_equivalents", lambda: listed)
    monkeypatch.setattr(command, "run_campaign", no_campaign)
    assert command.main([]) == 2
    assert "All drawn mutations are equivalent" in capsys.readouterr().err


@pytest.mark.usefixtures("small")
def test_the_summary_counts_timeouts(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    one, two = POSSIBLE[:2]
    results = [Result(one, "timeout"), Result(two, "tests/test_a.py::test_a")]
    monkeypatch.setattr(command, "run_campaign", lambda *args, **options: results)
    assert command.main([]) == 0
    assert "caught: 100% of 2 (1 by timeout, 0 equivalent)" in capsys.readouterr().out


def wait_for(path: Path) -> str:
    """Text of a file that another process writes."""
    end = time.monotonic() + 60.0
    while not (path.exists() and path.read_text()):
        assert time.monotonic() < end, f"{path} was not written"
        time.sleep(0.02)
    return path.read_text()


def waiting_test(file: Path) -> str:
    """A test that writes its process id and then waits."""
    return (
        "import os, pathlib, time\n\n\ndef test_wait():\n"
        f"    pathlib.Path({str(file)!r}).write_text(str(os.getpid()))\n    time.sleep(100)\n"
    )


PROGRAM = """
import sys
from pathlib import Path
from tests.interrupts import heeding_interrupts
from tests.mutants import __main__ as command
command.ROOT, command.read_equivalents = Path(sys.argv[1]), list
sys.exit(command.main(["--jobs", "2"]))
"""


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_kills_the_tests_and_removes_the_copies(tmp_path: Path, number: signal.Signals) -> None:
    checkout = small_checkout(tmp_path / "checkout", waiting_test(tmp_path / "pid"))
    (tmp_path / "temporary").mkdir()
    environment = os.environ | {"TMPDIR": str(tmp_path / "temporary"), "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(checkout)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heeding_interrupts,
    ) as process:
        try:
            child = int(wait_for(tmp_path / "pid"))
            assert list((tmp_path / "temporary").iterdir())
            process.send_signal(number)
            _, errors = process.communicate(timeout=30.0)
        finally:
            process.kill()
    assert (process.returncode, errors) == (130, "Interrupted.\n")
    assert not list((tmp_path / "temporary").iterdir())
    with pytest.raises(ProcessLookupError):
        os.kill(child, 0)


@pytest.mark.long
def test_tests_that_fail_without_a_mutation_stop_the_other_job(tmp_path: Path) -> None:
    """The first job waits in a test; the second one fails once the first has started."""
    file = tmp_path / "pid"
    red = (
        "import pathlib, time\n\n\ndef test_red():\n"
        f"    while not pathlib.Path({str(file)!r}).exists():\n        time.sleep(0.02)\n    assert False\n"
    )
    checkout, other = small_checkout(tmp_path / "checkout", waiting_test(file)), "harness/stream/small.py"
    for name, text in {other: SOURCE, "harness/stream/__init__.py": "", "tests/stream/test_other.py": red}.items():
        (checkout / name).parent.mkdir(parents=True, exist_ok=True)
        (checkout / name).write_text(text)
    reported, start = list[Result](), time.monotonic()
    drawn: list[Mutation] = [POSSIBLE[0], mutations(other, SOURCE)[0], *POSSIBLE[1:]]
    with pytest.raises(RedReference, match="test_red"):
        run_campaign(checkout, drawn, [], jobs=2, near=True, report=reported.append)
    assert time.monotonic() - start < 60.0
    assert reported == []


def test_no_process_starts_after_the_stop(tmp_path: Path) -> None:
    processes = ProcessGroups()
    write = [sys.executable, "-c", "print('text')"]
    assert processes.run(write, cwd=tmp_path, env=os.environ, limit_s=60.0) == (0, "text\n")
    processes.stop()
    with pytest.raises(Stopped):
        processes.run(["touch", "file"], cwd=tmp_path, env=os.environ, limit_s=60.0)
    assert not (tmp_path / "file").exists()
