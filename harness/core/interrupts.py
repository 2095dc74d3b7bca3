"""Interrupts of the program: SIGINT (Ctrl-C), SIGTERM and SIGHUP become one KeyboardInterrupt.

It is raised in the main thread, at a moment that Python code can bear: never inside an import, a compilation or code
that cleans up, never between the making of a resource and the line that takes care of it. Signals that follow while the
program cleans up belong to the same request. A signal that the parent made this process ignore, as a shell does for
jobs in the background and `nohup` for SIGHUP, stays ignored.
"""

import _thread  # its threads need no lock, which the interrupted code may hold
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import current_thread, main_thread
from types import FrameType

from harness.core.working_folder import safe_import_path

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
REPEAT_S = 0.5
"""A signal that follows another within this time is the same request: a closed terminal sends several [s, choice]."""
CLEAN_UP_S = 5.0
"""Time for which signals are ignored after KeyboardInterrupt was raised, because the program cleans up [s, choice]."""
MAX_WAIT_S = 30.0
"""Longest wait for a moment that can bear KeyboardInterrupt [s, choice]."""
_RETRY_S = 0.01
_WAIT_MODULES = ("numba.", "llvmlite.", "tempfile", "shutil", "weakref")
"""Modules in which an exception from outside leaves a compiler's state or a temporary file behind."""
_WAIT_FUNCTIONS = frozenset(
    {
        ("threading", "start"),
        ("subprocess", "__init__"),
        ("multiprocessing.process", "start"),
    }
)


@dataclass
class _State:
    """What the handler knows; only the main thread changes it."""

    installed: bool = False
    accepted: bool = False
    """Whether KeyboardInterrupt may be raised; else a signal is kept until it may."""
    deferrals: int = 0
    """Number of nested `defer_interrupts`."""
    request: Callable[[], None] | None = None
    """What the next signal calls instead of raising."""
    last_s: float = float("-inf")
    """Time of the last signal that counted."""
    waiting: bool = False
    """Whether that signal has not been answered yet."""
    raised_s: float = float("-inf")


_state = _State()


@contextmanager
def hold_interrupts() -> Iterator[None]:
    """Keep signals in the block until `accept_interrupts`. Does nothing in another thread, or inside another hold."""
    if _state.installed or current_thread() is not main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in SIGNALS}
    vars(_state).update(vars(_State(installed=True)))
    for number, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, _handle)
    try:
        yield
    finally:
        _state.accepted = _state.installed = False
        for number, handler in before.items():
            if signal.getsignal(number) is _handle:
                signal.signal(number, signal.SIG_DFL if handler is None else handler)


def ignore_interrupts() -> None:
    """Ignore signals from now on: the program has its result and only has to end."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def accept_interrupts() -> Iterator[None]:
    """A signal in the block, or one that was kept before it, raises KeyboardInterrupt there."""
    if current_thread() is not main_thread():
        yield
        return
    with hold_interrupts():
        before, _state.accepted = _state.accepted, True
        try:
            if _state.waiting:
                raise_interrupt()
            yield
        finally:
            _state.accepted = before


def refuse_interrupts() -> None:
    """End the effect of `accept_interrupts`: what follows is short and has to be whole, such as printing a result."""
    _state.accepted = False


@contextmanager
def defer_interrupts() -> Iterator[None]:
    """A signal in the block raises KeyboardInterrupt after it. For short work that must not be left half done."""
    if current_thread() is not main_thread():
        yield
        return
    _state.deferrals += 1
    try:
        yield
    finally:
        _state.deferrals -= 1


@contextmanager
def shield_children() -> Iterator[None]:
    """Processes that are started in the block never see a signal, not even while they start; it also defers interrupts.

    The signals are blocked, which children inherit. Those that are sent to this process meanwhile are not lost. The
    processes import nothing from the working folder.
    """
    with defer_interrupts(), safe_import_path():
        if not hasattr(signal, "pthread_sigmask"):  # Windows
            yield
            return
        from multiprocessing import resource_tracker  # here: most verbs start no process

        before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
        try:
            resource_tracker.ensure_running()  # the start of the first process would do so, and unblocks signals
            signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def answer_first_interrupt(request: Callable[[], None]) -> Iterator[None]:
    """The first signal in the block calls `request`, which must be short; the next raises KeyboardInterrupt."""
    with accept_interrupts():
        before = _state.request
        if current_thread() is main_thread():
            _state.request = request
        try:
            yield
        finally:
            if current_thread() is main_thread():
                _state.request = before


def _handle(number: int, frame: FrameType | None) -> None:
    now_s = time.monotonic()
    if now_s - _state.raised_s < CLEAN_UP_S:
        return
    if not _state.waiting:
        if now_s - _state.last_s < REPEAT_S:
            return
        _state.last_s = now_s
        if _state.request is not None:
            request, _state.request = _state.request, None
            request()
            return
        _state.waiting = True
    if not _state.accepted:
        return
    if _must_wait(frame) and now_s - _state.last_s < MAX_WAIT_S:
        _thread.start_new_thread(_repeat, (number,))
        return
    raise_interrupt()


def _repeat(number: int) -> None:
    time.sleep(_RETRY_S)
    _thread.interrupt_main(signal.Signals(number))


def raise_interrupt() -> None:
    """Raise KeyboardInterrupt; signals that follow within `CLEAN_UP_S` are ignored."""
    _state.waiting, _state.raised_s = False, time.monotonic()
    raise KeyboardInterrupt


def _must_wait(frame: FrameType | None) -> bool:
    """Whether code on the stack would be left in disorder: an import, a compilation, a start of a process, cleaning."""
    if _state.deferrals:
        return True
    while frame is not None:
        code, module = frame.f_code, str(frame.f_globals.get("__name__"))
        if (
            code.co_name in ("__exit__", "__del__")
            or (code.co_name == "__enter__" and module.startswith("harness."))
            or code.co_filename.startswith("<frozen importlib")
            or module.startswith(_WAIT_MODULES)
            or (module, code.co_name) in _WAIT_FUNCTIONS
        ):
            return True
        frame = frame.f_back
    return False
