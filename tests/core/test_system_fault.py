"""Which errors that a method's code meets are faults of the system, and not its own."""

import errno

import pytest

from harness.core.fault_report import find_system_fault
from harness.errors import BadInput, SystemFault


def raised_in(module: str, error: Exception) -> Exception:
    """An error that was raised by a function of a module."""
    namespace: dict[str, object] = {"__name__": module, "error": error.with_traceback(None)}
    try:
        exec("def work():\n    raise error\nwork()", namespace)  # noqa: S102  # a frame of a module of that name
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
