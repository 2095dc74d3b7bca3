"""The process of one method, seen from the program that starts it: requests, answers, limits and its end.

Requests and answers are numbers and texts (`core.messages`), so that an answer cannot carry code into this program.
"""

import signal
from contextlib import suppress
from threading import Lock, Timer

from harness import errors
from harness.core.messages import MessageError, read_message, write_message
from harness.errors import HarnessError, Outcome, SystemFault
from harness.experiment.methods.file_audit import UndeclaredInput
from harness.experiment.methods.isolation import Isolation
from harness.experiment.methods.method_messages import MAX_TEXT, Arrays, Header, Message
from harness.experiment.methods.worker_process import WorkerProcess, start_worker

_TAINTED = UndeclaredInput.__name__
_EXIT_S = 5.0
"""Time that a process has to end after its answers ended [s]; then it is killed."""
_START_S = 120.0
"""Time that a process has until it can take requests [s]; it has not seen the method by then."""
_KNOWN_ERRORS = ("SystemFault", "UnknownName", "RenamedKey", "ShapeError", "BadFile", "BadInput", "MissingExtra")


class MethodFailure(HarnessError):
    """A method's process failed: the method raised an error, or its process ended, hung or answered nonsense."""

    outcome = Outcome.INCOMPLETE


class MethodProcess:
    """The process of one method, started when it is first needed, and again after it ended."""

    def __init__(
        self, name: str, isolation: Isolation, worker: str = "harness.experiment.methods.method_worker"
    ) -> None:
        """The process runs `main` of the module `worker`."""
        self.name, self.isolation, self._worker = name, isolation, worker
        self._process: WorkerProcess | None = None
        self._ready = False
        self.starts = 0
        """Number of times that the process was started. What it was sent before is lost with each."""
        self._requests = 0
        self._lock = Lock()
        """Held during a request: sessions in several threads share the process."""

    def start(self) -> WorkerProcess:
        """Start the process unless it runs; it gets ready on its own."""
        if self._process is None or self._process.wait(0.0) is not None:
            self.close()
            self._process, self._ready = start_worker(self._worker), False
            self.starts += 1
        return self._process

    def request(self, header: Header, arrays: Arrays, max_bytes: float) -> Message:
        """Send a request and return the answer.

        MethodFailure, and the errors of the package that the method raises. SystemFault when the process ends before it
        has seen the method, and for a fault of the system that the method meets.
        """
        with self._lock:
            process, limit_s = self.start(), self.isolation.time_limit_s
            if not self._ready:
                try:
                    self._exchange(process, None, {}, MAX_TEXT, _START_S)
                except MethodFailure as error:
                    advice = "The method was not loaded yet: the harness cannot work here. Does `harness doctor` pass?"
                    raise SystemFault(str(error), advice) from None
                self._ready = True
            return self._request(process, {**header, "limit_s": limit_s + _EXIT_S}, arrays, max_bytes)

    def _request(self, process: WorkerProcess, header: Header, arrays: Arrays, max_bytes: float) -> Message:
        answer = self._exchange(process, header, arrays, max_bytes, self.isolation.time_limit_s)
        if answer[0].get("error") == _TAINTED:
            self.close()  # what was read may still be in its memory
        if "error" in answer[0]:
            raise _to_exception(answer[0], self.isolation)
        return answer

    def _exchange(
        self, process: WorkerProcess, header: Header | None, arrays: Arrays, max_bytes: float, limit_s: float
    ) -> Message:
        """Send a request, if any, and read a message; MethodFailure when there is none within the limit."""
        expired = list[float]()

        def expire() -> None:
            expired.append(limit_s)
            process.kill()

        timer = Timer(limit_s, expire)
        timer.daemon = True
        timer.start()
        try:
            if header is not None:
                self._requests += 1
                write_message(process.requests, {**header, "request": self._requests}, arrays)
            answer = read_message(process.answers, max_bytes)
            if header is not None and answer[0].pop("request", None) != self._requests:
                raise MessageError("the answer to another request")
        except (OSError, MessageError) as error:
            raise MethodFailure(self._describe_end(process, expired, error)) from None
        except BaseException:  # such as Ctrl-C: nobody will read the answer
            self.close()
            raise
        finally:
            timer.cancel()
        return answer

    def close(self) -> None:
        """End the process and those that it started."""
        process, self._process = self._process, None
        if process is not None:
            process.close()

    def _describe_end(self, process: WorkerProcess, expired: list[float], error: Exception) -> str:
        """Why there is no answer, in one line."""
        code = process.wait(_EXIT_S)
        self.close()
        if expired:
            return f"{self.name} gave no answer within {expired[0]:g} s. Raise --time-limit."
        if code is None:
            return f"{self.name} sent an answer that cannot be read ({error})."
        if code < 0:
            names = {int(known): known.name for known in signal.Signals}
            memory = " The machine may be out of memory." if code == -9 else ""
            return f"The process of {self.name} was killed by {names.get(-code, f'signal {-code}')}.{memory}"
        return f"The process of {self.name} ended with exit code {code}."


def _to_exception(header: Header, isolation: Isolation) -> Exception:
    """The exception of an answer: an error of the package, or a MethodFailure with the traceback."""
    kind, text = header.get("error"), str(header.get("text", ""))[-MAX_TEXT:]
    if kind == _TAINTED:
        return MethodFailure(str(header.get("message"))[:MAX_TEXT])
    if kind in _KNOWN_ERRORS:
        with suppress(Exception):  # a hostile process may send any fields
            fields = [tuple(field) if isinstance(field, list) else field for field in header["fields"]]
            error: HarnessError = getattr(errors, str(kind))(*fields)
            str(error)
            return error
    if kind == "MemoryError":
        limit = f"It may use {isolation.memory_bytes / 1e9:.1f} GB. Raise --memory-limit."
        return MethodFailure(f"{text.rstrip()}\n{limit}")
    return MethodFailure(text)
