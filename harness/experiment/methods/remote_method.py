"""Methods in processes of their own: one that exits, hangs, crashes or eats the memory costs a cell and nothing else.

`RemoteMethod` stands for a method in another process. Frames, examples and answers are copied on their way: no method
can change what another one receives, what it has answered before, or how it is scored.
"""

import atexit
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import count
from typing import TypeVar

import numpy as np

from harness.body import Body
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.messages import MessageError
from harness.core.motion import BodyMotion
from harness.core.object_state import describe_state
from harness.core.split import declared_training_data
from harness.core.working_folder import served_folders
from harness.errors import HarnessError
from harness.experiment.methods.isolation import Isolation
from harness.experiment.methods.method_messages import (
    MAX_TEXT,
    Arrays,
    Header,
    Message,
    answers_size,
    decode_answers,
    encode_take,
    encode_training,
)
from harness.experiment.methods.method_process import MethodFailure, MethodProcess
from harness.experiment.methods.method_run import MethodAnswers, run_method
from harness.experiment.methods.worker_process import close_fork_server
from harness.reconstruct import Method, Reconstructor, is_built_in, make_method, source_hash
from harness.stream import TrackerFrame

R = TypeVar("R")

_MAX_REPLY_BYTES = 100 * MAX_TEXT


@dataclass(frozen=True)
class _Description:
    summary: str
    needs_examples: bool
    training_data: str
    options: str
    source_hash: str


_numbers = count()


@dataclass(eq=False)
class RemoteMethod:
    """A `Method` that lives in another process."""

    name: str
    process: MethodProcess
    _described: "_Description | Exception | None" = None
    _described_start: int = field(default=0)

    def describe(self) -> _Description:
        """What the method says of itself, asked once for each start of its process.

        MethodFailure when it cannot be made, or when its source has changed since the first start.
        """
        known = self._described
        if isinstance(known, Exception):
            raise known
        if known is not None and self._described_start == self.process.starts:
            return known
        try:
            found = self._ask()
        except (MethodFailure, HarnessError) as error:
            self._described = error
            raise
        if known is not None and known != found:
            raise MethodFailure(f"The source of {self.name} has changed since the run began. Run again.")
        self._described, self._described_start = found, self.process.starts
        return found

    def _ask(self) -> _Description:
        path, memory_bytes = [os.path.abspath(entry) for entry in sys.path], self.process.isolation.memory_bytes
        header = {
            "operation": "describe",
            "name": self.name,
            "path": path,
            "folders": served_folders(),
            "memory_bytes": memory_bytes,
        }
        answer, _ = self.process.request(header, {}, _MAX_REPLY_BYTES)
        return self.read(lambda: _Description(**answer))

    def read(self, decode: Callable[[], R]) -> R:
        """What an answer contains; MethodFailure, and the end of its process, when it is anything else."""
        try:
            return decode()
        except (MessageError, HarnessError, KeyError, TypeError, ValueError) as error:
            self.process.close()
            raise MethodFailure(f"{self.name} sent an answer that cannot be read ({error}).") from None

    @property
    def summary(self) -> str:
        return self.describe().summary

    @property
    def needs_examples(self) -> bool:
        return self.describe().needs_examples

    @property
    def training_data(self) -> str:
        return self.describe().training_data

    @property
    def source_hash(self) -> str:
        """Hash of its code, of its declared data files and of the environment variables that it declares."""
        return self.describe().source_hash

    @property
    def options(self) -> str:
        """Text of its attributes in the other process."""
        return self.describe().options

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "RemoteReconstructor":
        """Train the method in its process."""
        fitted = RemoteReconstructor(self, encode_training(body, examples, rng))
        fitted.send()
        return fitted


@dataclass(eq=False)
class RemoteReconstructor:
    """A trained method in another process; it is trained again after the process ended."""

    method: RemoteMethod
    training: Message
    _number: int = -1
    """Number of the last training that was sent."""

    def send(self) -> None:
        """Send the training to the process of the method."""
        self.method.process.start()
        self.method.describe()
        self._number = next(_numbers)
        header = {"operation": "fit", "fit": self._number, **self.training[0]}
        self.method.process.request(header, self.training[1], _MAX_REPLY_BYTES)

    def run(self, calibration: Calibration, frames: Sequence[TrackerFrame]) -> MethodAnswers:
        """Run the method over the frames of a take, see `method_run.run_method`; MethodFailure."""
        content = self._ask({"operation": "run"}, encode_take(calibration, frames), answers_size(len(frames)))
        return self.method.read(lambda: decode_answers(content, len(frames)))

    def begin(self, calibration: Calibration) -> "RemoteSession":
        """Begin a session, which is asked frame by frame."""
        session = RemoteSession(self.method, calibration, next(_numbers))
        self._ask({"operation": "begin", "session": session.number}, encode_take(calibration, []), _MAX_REPLY_BYTES)
        return session

    def _ask(self, operation: Header, take: Message, max_bytes: float) -> Arrays:
        """The arrays of an answer; the training is sent again to a process that does not have it."""
        process, (header, arrays) = self.method.process, take
        for _ in range(2):
            answer, content = process.request({**operation, "fit": self._number, **header}, arrays, max_bytes)
            if answer.get("fitted") is not False:  # else it is a new process, or one that keeps later trainings
                return content
            self.send()
        raise MethodFailure(f"{self.method.name} forgot its training.")


@dataclass(eq=False)
class RemoteSession:
    """A session in another process; it ends with that process."""

    method: RemoteMethod
    calibration: Calibration
    number: int

    def step(self, frame: TrackerFrame) -> Estimate:
        """Estimate of the body at a frame; MethodFailure."""
        header, arrays = encode_take(self.calibration, [frame])
        request = {"operation": "step", "session": self.number, **header}
        answer, content = self.method.process.request(request, arrays, _MAX_REPLY_BYTES)
        sigma_rad = content.get("angle_sigma_rad")
        return self.method.read(
            lambda: Estimate(content["qpos"], answer["status"], answer["origin"], sigma_rad, answer["lag"])
        )


_remote_methods: dict[tuple[str, Isolation], RemoteMethod] = {}
"""The methods of this program that have processes."""


def resolve_method(name: str, isolation: Isolation) -> Method:
    """The method of a name, in a process of its own if it is from outside the package or `isolation` says so.

    UnknownName, RenamedKey and BadInput as for `make_method`; MethodFailure when its process fails.
    """
    method = _remote_method(name, isolation)
    if method is None:
        return make_method(name)
    method.describe()
    return method


def start_methods(names: Iterable[str], isolation: Isolation) -> None:
    """Start the processes of the methods that need one, so that they get ready at the same time."""
    for name in names:
        if method := _remote_method(name, isolation):
            method.process.start()


def _remote_method(name: str, isolation: Isolation) -> RemoteMethod | None:
    if is_built_in(name) and not isolation.every_method:
        return None
    if (name, isolation) not in _remote_methods:
        atexit.unregister(close_methods)
        atexit.register(close_methods)
        _remote_methods[name, isolation] = RemoteMethod(name, MethodProcess(name, isolation))
    return _remote_methods[name, isolation]


def close_methods() -> None:
    """End the processes of all methods, and forget the methods that were found."""
    find_method.cache_clear()
    while _remote_methods:
        _remote_methods.popitem()[1].process.close()
    close_fork_server()


@dataclass(frozen=True, eq=False)
class NamedMethod:
    """A method, and what results say of it: as its process has read them if it has one."""

    name: str
    method: Method

    @property
    def source_hash(self) -> str:
        """Hash of its code and of its declared inputs."""
        return self.method.source_hash if isinstance(self.method, RemoteMethod) else source_hash(self.method)

    @property
    def options(self) -> str:
        """Text of its attributes (`describe_state`)."""
        if isinstance(self.method, RemoteMethod):
            return self.method.options
        return describe_state(self.method, self.method.name)

    @property
    def training_data(self) -> str:
        """The training data that it declares (`core.split`)."""
        return declared_training_data(self.method)

    @property
    def identity(self) -> dict[str, str]:
        """What the key of a cell says of it: another method, other options or another source have another key."""
        return {"name": self.name, "options": self.options, "source": self.source_hash}


@cache
def find_method(name: str, isolation: Isolation) -> NamedMethod:
    """The method of a name (`resolve_method`), found once: searching the installed packages takes long."""
    return NamedMethod(name, resolve_method(name, isolation))


def run_over_frames(fitted: Reconstructor, calibration: Calibration, frames: Sequence[TrackerFrame]) -> MethodAnswers:
    """Run a trained method over the frames of a take, in its process if it has one."""
    if isinstance(fitted, RemoteReconstructor):
        return fitted.run(calibration, frames)
    return run_method(fitted, calibration, frames)
