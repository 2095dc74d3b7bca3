"""The process of one method: it makes the method, trains it and runs it, and sees no truth and no other method.

It reads requests and writes answers (`core.messages`). What the method prints goes to stderr. The process ends with
the program that started it (`worker_process`).
"""

import os
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable
from contextlib import suppress
from queue import SimpleQueue
from threading import Thread
from typing import Any, BinaryIO

from harness.core.estimate import as_estimate
from harness.core.fault_report import find_system_fault
from harness.core.messages import MessageError, read_message, write_message
from harness.core.object_state import describe_state
from harness.core.split import declared_training_data
from harness.core.working_folder import serve_folder
from harness.errors import BadInput, HarnessError, SystemFault, shorten
from harness.experiment.methods.file_audit import FileAudit, UndeclaredInput
from harness.experiment.methods.method_messages import (
    MAX_TEXT,
    Arrays,
    Header,
    Message,
    decode_take,
    decode_training,
    encode_answers,
)
from harness.experiment.methods.method_run import run_method
from harness.reconstruct import (
    Method,
    Reconstructor,
    Session,
    declared_environment,
    defining_module,
    find_source_files,
    make_method,
    source_hash,
)

_KEPT_FITS = 2
"""Number of trained methods that are kept: those of the last two sets of examples."""


class MethodWorker:
    """Answers the requests about one method: `describe`, `fit` and `run`, or `begin` and `step` frame by frame."""

    def __init__(self) -> None:
        self._audit = FileAudit()
        self.method: Method | None = None
        self._fits: dict[int, Reconstructor] = {}
        self._sessions: dict[int, Session] = {}

    def answer(self, header: Header, arrays: Arrays) -> Message:
        """The answer to a request; whatever the method raises, SystemExit and KeyboardInterrupt too, is an answer."""
        try:
            answer = self.operations()[header["operation"]](header, arrays)
            if self._audit.violation is not None:
                raise self._audit.violation
        except BaseException as raised:
            error = find_system_fault(raised) or raised
            refusal = header["operation"] in ("describe", "fit")  # a step that raises anything has failed
            known = isinstance(error, HarnessError) and error is not self._audit.violation
            known = known and (refusal or isinstance(error, SystemFault))
            fields = [list(f) if isinstance(f, tuple) else f for f in error.args] if known else []
            text = "".join(traceback.format_exception(error))[-MAX_TEXT:]
            message = str(error) if isinstance(error, UndeclaredInput) else ""  # `str` of another may fail
            return {"error": type(error).__name__, "text": text, "message": message, "fields": fields}, {}
        return answer

    def operations(self) -> dict[str, Callable[[Header, Arrays], Message]]:
        """Name -> the function that answers a request of that name."""
        return {
            "describe": self._describe,
            "fit": self._fit,
            "run": self._run,
            "begin": self._begin,
            "step": self._step,
        }

    def _describe(self, header: Header, arrays: Arrays) -> Message:
        sys.path[:] = header["path"]
        for folder, names in header["folders"].items():
            serve_folder(folder, names)
        _limit_memory(header["memory_bytes"])
        self._audit.package = defining_module(header["name"]).partition(".")[0]
        method = make_method(header["name"])
        modules = tuple(sys.modules.values())
        self._audit.cover(find_source_files(method, modules), declared_environment(method))
        self.method = method
        return {
            "summary": str(method.summary),
            "needs_examples": bool(method.needs_examples),
            "training_data": declared_training_data(method),
            "options": _stable_options(method, header["name"]),
            "source_hash": source_hash(method, modules),
        }, {}

    def _fit(self, header: Header, arrays: Arrays) -> Message:
        if self.method is None:
            raise RuntimeError("the method was not described")
        for number in sorted(self._fits)[: max(len(self._fits) + 1 - _KEPT_FITS, 0)]:
            del self._fits[number]
        self._fits[header["fit"]] = self.method.fit(*decode_training(header, arrays))
        return {}, {}

    def _run(self, header: Header, arrays: Arrays) -> Message:
        if header["fit"] not in self._fits:
            return {"fitted": False}, {}
        answers = run_method(self._fits[header["fit"]], *decode_take(header, arrays))
        return {"fitted": True}, encode_answers(answers)

    def _begin(self, header: Header, arrays: Arrays) -> Message:
        if header["fit"] not in self._fits:
            return {"fitted": False}, {}
        calibration, _ = decode_take(header, arrays)
        self._sessions[header["session"]] = self._fits[header["fit"]].begin(calibration)
        return {"fitted": True}, {}

    def _step(self, header: Header, arrays: Arrays) -> Message:
        _, (frame,) = decode_take(header, arrays)
        estimate = as_estimate(self._sessions[header["session"]].step(frame))
        answer = {"qpos": estimate.qpos}
        if estimate.angle_sigma_rad is not None:
            answer["angle_sigma_rad"] = estimate.angle_sigma_rad
        return {"status": int(estimate.status), "origin": int(estimate.origin), "lag": estimate.lag}, answer


def _stable_options(method: Method, name: str) -> str:
    """Text of a method's attributes; BadInput unless another making of it has the same, so that its cells are found."""
    made, again = describe_state(method, name), describe_state(make_method(name), name)
    if made == again:
        return made.replace(tempfile.gettempdir(), "<TMPDIR>")  # each process has its own
    differ = (place for place, (one, other) in enumerate(zip(made, again, strict=False)) if one != other)
    at = next(differ, min(len(made), len(again)))
    found = " and then ".join(shorten(text[max(at - 40, 0) :], 60) for text in (made, again))
    raise BadInput(
        f"{name} is in another state each time that it is made: {found}.",
        "Draw random numbers and read clocks in `fit`, which receives `rng`; else its cells are never found again.",
    )


def serve(worker: MethodWorker, *descriptors: str) -> None:
    """Answer requests until they end; without the descriptors of both streams, on standard input and output."""
    requests, replies = _open_streams(*map(int, descriptors)) if descriptors else _take_streams()
    inbox = SimpleQueue[tuple[dict[str, Any], Any]]()
    write_message(replies, {"ready": True})
    Thread(target=_receive, args=(requests, inbox), daemon=True).start()
    while True:
        header, arrays = inbox.get()
        _limit_time(header["limit_s"])
        answer = worker.answer(header, arrays)
        _limit_time(0.0)
        write_message(replies, {**answer[0], "request": header["request"]}, answer[1])


def _open_streams(requests: int, replies: int) -> tuple[BinaryIO, BinaryIO]:
    return os.fdopen(requests, "rb"), os.fdopen(replies, "wb")


def _take_streams() -> tuple[BinaryIO, BinaryIO]:
    """Private copies of the standard streams; a method that prints, reads or closes them disturbs nobody."""
    requests, replies = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)
    os.close(nothing)
    return requests, replies


def _receive(requests: BinaryIO, inbox: "SimpleQueue[tuple[dict[str, Any], Any]]") -> None:
    """Pass requests on; when the sender is gone, end this process and those that the method started."""
    with suppress(MessageError, OSError):
        while True:
            inbox.put(read_message(requests))
    if sys.platform != "win32":
        os.killpg(0, signal.SIGKILL)
    os._exit(1)


def _limit_time(limit_s: float) -> None:
    """Let the system end this process after a time, also if nobody is left who would; 0 for no limit."""
    if sys.platform != "win32":
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, limit_s)


def _limit_memory(limit_bytes: int) -> None:
    """Let allocations fail beyond a size of this process, or beyond a smaller limit of its user; Linux enforces it."""
    if sys.platform == "linux":
        import resource

        _, most_bytes = resource.getrlimit(resource.RLIMIT_DATA)
        if most_bytes != resource.RLIM_INFINITY:
            limit_bytes = min(limit_bytes, most_bytes)
        resource.setrlimit(resource.RLIMIT_DATA, (limit_bytes, limit_bytes))


def main(*descriptors: str) -> None:
    """Serve a method to a run."""
    serve(MethodWorker(), *descriptors)
