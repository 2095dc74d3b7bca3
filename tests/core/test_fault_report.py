"""The cause of a fault names the setting that a library cannot work with."""

import os
import subprocess
import sys
from types import FunctionType

import pytest

from harness.core.fault_report import describe_fault


def fail() -> None:
    raise ValueError("0 threads")


def raise_in(module: str) -> Exception:
    """An error that arose in a module of this name."""
    with pytest.raises(ValueError, match="0 threads") as caught:
        FunctionType(fail.__code__, {"__name__": module})()
    return caught.value


def test_an_error_of_a_library_names_its_variables(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in os.environ if name.startswith("NUMBA_")]:
        monkeypatch.delenv(name)
    assert describe_fault(raise_in("numba.core.config"))[0].startswith("a defect of the program")
    monkeypatch.setenv("NUMBA_NUM_THREADS", "0")
    cause, advice = describe_fault(raise_in("numba.core.config"))
    assert cause == "a library failed (ValueError: 0 threads) where NUMBA_NUM_THREADS=0 is set."
    assert advice == "Unset it, then give the same command again."
    assert describe_fault(raise_in("harness.core.runs"))[0].startswith("a defect of the program")


@pytest.mark.long
@pytest.mark.parametrize(("text", "cause"), [("", "(MemoryError)"), ("1 TiB", "(1 TiB)")])
def test_a_lack_of_memory_is_named(text: str, cause: str) -> None:
    assert describe_fault(MemoryError(text))[0] == f"not enough memory {cause}."


def test_a_command_says_so() -> None:
    environment = {**os.environ, "NUMBA_NUM_THREADS": "0"}
    command = [sys.executable, "-m", "harness", "list"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 5
    assert "where NUMBA_NUM_THREADS=0 is set. " in done.stderr
