"""Which errors that a method's code meets are faults of the system, and not its own."""

import errno
from types import FunctionType

import pytest

from harness.core.fault_report import find_system_fault
from harness.errors import BadInput, SystemFault, was_interrupted
from harness.experiment.method_run import describe_failure


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
