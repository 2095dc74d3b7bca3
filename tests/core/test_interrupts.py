"""Signals become one KeyboardInterrupt, at a moment that Python code can bear."""

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import pytest

from harness.core import interrupts
from harness.core.interrupts import (
    accept_interrupts,
    answer_first_interrupt,
    defer_interrupts,
    hold_interrupts,
    refuse_interrupts,
    shield_children,
)

_LATE_S = 2.0
"""Time within which a kept signal is answered [s]."""


@pytest.fixture(autouse=True)
def own_signals() -> Iterator[None]:
    """Signals are not ignored, as they are in the background, and no test leaves a handler to the next one."""
    given = {number: signal.signal(number, signal.SIG_DFL) for number in interrupts.SIGNALS}
    yield
    left = {number: signal.signal(number, handler) for number, handler in given.items()}
    assert set(left.values()) == {signal.SIG_DFL}


@contextmanager
def interrupted() -> Iterator[None]:
    """Exactly one interrupt leaves the block."""
    count = 0
    try:
        with accept_interrupts():
            yield
    except KeyboardInterrupt:
        count = 1
    assert count == 1


def wait() -> None:
    """Let signals that were kept come."""
    end_s = time.monotonic() + _LATE_S
    while time.monotonic() < end_s:
        time.sleep(0.01)


@pytest.mark.parametrize("number", interrupts.SIGNALS)
def test_a_signal_is_an_interrupt(number: signal.Signals) -> None:
    with interrupted():
        signal.raise_signal(number)
        wait()


def test_signals_that_follow_do_not_disturb_what_cleans_up() -> None:
    done = []
    with interrupted():
        try:
            signal.raise_signal(signal.SIGTERM)
            wait()
        finally:
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGHUP)
            time.sleep(0.05)
            done.append("cleaned")
    assert done == ["cleaned"]


def test_a_clean_up_that_hangs_can_be_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interrupts, "CLEAN_UP_S", 0.1)
    monkeypatch.setattr(interrupts, "REPEAT_S", 0.0)
    seen = []
    with interrupted():
        try:
            signal.raise_signal(signal.SIGTERM)
            wait()
        finally:
            time.sleep(0.2)
            try:
                signal.raise_signal(signal.SIGINT)
                wait()
            except KeyboardInterrupt:
                seen.append("again")
    assert seen == ["again"]


def test_short_work_is_not_interrupted() -> None:
    done = []
    with interrupted():
        with defer_interrupts():
            signal.raise_signal(signal.SIGINT)
            time.sleep(0.05)
            done.append("whole")
        wait()
    assert done == ["whole"]


def test_an_import_is_not_interrupted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "imported_once.py").write_text(
        "import signal, time\nsignal.raise_signal(signal.SIGTERM)\ntime.sleep(0.05)\nCOMPLETE = True\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    with interrupted():
        import imported_once  # type: ignore[import-not-found]

        wait()
    assert sys.modules["imported_once"].COMPLETE
    assert imported_once


def test_the_end_of_a_block_is_not_interrupted() -> None:
    done = []

    class Resource:
        def __enter__(self) -> None:
            pass

        def __exit__(self, *raised: object) -> None:
            signal.raise_signal(signal.SIGHUP)
            time.sleep(0.05)
            done.append("released")

    with interrupted():
        with Resource():
            pass
        wait()
    assert done == ["released"]


def test_a_signal_that_the_parent_ignores_stays_ignored() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with accept_interrupts():
            signal.raise_signal(signal.SIGINT)
            time.sleep(0.05)
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_signal_before_the_work_comes_when_the_work_begins() -> None:
    begun = []
    with hold_interrupts():
        signal.raise_signal(signal.SIGTERM)
        time.sleep(0.05)
        begun.append("parsed")
        with pytest.raises(KeyboardInterrupt), accept_interrupts():
            begun.append("worked")
    assert begun == ["parsed"]


def test_a_result_is_printed_whole() -> None:
    with accept_interrupts():
        refuse_interrupts()
        signal.raise_signal(signal.SIGINT)
        time.sleep(0.05)


def test_the_first_signal_asks_and_the_next_raises(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    with interrupted(), answer_first_interrupt(lambda: asked.append("stop")):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGTERM)  # within 50 ms: the same request
        time.sleep(0.05)
        assert asked == ["stop"]
        monkeypatch.setattr(interrupts, "REPEAT_S", 0.0)
        signal.raise_signal(signal.SIGINT)
        wait()
    assert asked == ["stop"]


def test_children_see_no_signal() -> None:
    code = "import signal; print(sorted(signal.pthread_sigmask(signal.SIG_BLOCK, [])))"
    with shield_children():
        said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    for number in interrupts.SIGNALS:
        assert repr(number) in said
    assert not signal.pthread_sigmask(signal.SIG_BLOCK, []) & set(interrupts.SIGNALS)


def test_the_first_use_of_multiprocessing_leaves_signals_blocked() -> None:
    """It starts a process of its own, and unblocked SIGINT and SIGTERM: Ctrl-C then ended the page with a traceback."""
    script = """
import multiprocessing, signal
from harness.core.interrupts import SIGNALS, shield_children
with shield_children():
    multiprocessing.get_context("spawn").Lock()
    print(set(SIGNALS) <= signal.pthread_sigmask(signal.SIG_BLOCK, []))
print(set(SIGNALS) & signal.pthread_sigmask(signal.SIG_BLOCK, []))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("True\nset()\n", "")


def test_a_signal_to_this_process_is_not_lost_while_a_child_starts() -> None:
    with interrupted():
        with shield_children():
            signal.raise_signal(signal.SIGTERM)
        wait()


def test_handlers_of_others_are_put_back() -> None:
    def handle(number: int, frame: FrameType | None) -> None: ...

    before = signal.signal(signal.SIGTERM, handle)
    try:
        with accept_interrupts():
            assert signal.getsignal(signal.SIGTERM) is not handle
        assert signal.getsignal(signal.SIGTERM) is handle
    finally:
        signal.signal(signal.SIGTERM, before)
