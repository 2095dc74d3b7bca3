"""The cause of a fault names the setting that a library cannot work with."""

import errno
import os
import subprocess
import sys
from types import FunctionType

import pytest

from harness.core.fault_report import describe_fault, find_system_fault
from harness.errors import BadInput, SystemFault, was_interrupted
from harness.experiment.methods import describe_failure


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
    assert describe_fault(raise_in("harness.core.arrays"))[0].startswith("a defect of the program")


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


def raise_error(error: Exception) -> None:
    raise error


def raised_in(module: str, error: Exception) -> Exception:
    """An error that was raised by a function of a module."""
    work = FunctionType(raise_error.__code__, {"__name__": module})
    try:
        work(error.with_traceback(None))
    except Exception as caught:
        return caught
    raise AssertionError


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EIO])
def test_a_disk_that_fails(number: int) -> None:
    fault = find_system_fault(OSError(number, "the disk"))
    assert isinstance(fault, SystemFault)
    assert "the disk" in str(fault)


def test_the_cause_of_another_error() -> None:
    error = BadInput("mine:Mine cannot be made.", "")
    error.__cause__ = OSError(errno.ENOSPC, "No space left on device")
    assert find_system_fault(error) is not None


@pytest.mark.parametrize("error", [RuntimeError("inherited across fork"), OSError(errno.EACCES, "not yours")])
def test_a_function_that_cannot_be_compiled(error: Exception) -> None:
    assert "cannot be compiled" in str(find_system_fault(raised_in("harness.core.compiled", error)))
    assert find_system_fault(raised_in("mine", error)) is None


@pytest.mark.parametrize(
    "error", [ValueError("shape"), TypeError("no number"), FileNotFoundError(errno.ENOENT, "none")]
)
def test_what_a_method_does_wrong(error: Exception) -> None:
    assert find_system_fault(raised_in("mine", error)) is None


def test_arguments_that_cannot_be_compiled_are_the_methods() -> None:
    from numba.core.errors import TypingError

    assert find_system_fault(raised_in("harness.core.compiled", TypingError("a text"))) is None


def test_errors_that_lead_to_each_other() -> None:
    """A method may raise an error from itself, or two from each other."""
    first, second = ValueError("one"), ValueError("two")
    first.__cause__, second.__cause__ = second, first
    assert find_system_fault(first) is None
    assert not was_interrupted(first)
    second.__cause__ = KeyboardInterrupt()
    assert was_interrupted(first)


@pytest.mark.parametrize("depth", [0, 1, 2])
def test_a_fault_of_the_system_is_raised_again_and_leads_to_itself_by_no_way(depth: int) -> None:
    fault = SystemFault("The disk is full.", "")
    error: Exception = fault
    for _ in range(depth):
        outer = ValueError("a method")
        outer.__cause__, error = error, outer

    def describe() -> None:
        try:
            raise error
        except (ValueError, SystemFault) as caught:
            describe_failure(caught)

    with pytest.raises(SystemFault, match="disk is full") as raised:
        describe()
    assert raised.value is fault
    assert not was_interrupted(raised.value)
