"""Methods in processes of their own: start, requests and answers, limits."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.experiment.methods.isolation import DEFAULT_ISOLATION, DEFAULT_TIME_LIMIT_S, Isolation
    from harness.experiment.methods.method_messages import MAX_TEXT, Arrays, Header, Message
    from harness.experiment.methods.method_process import MethodFailure, MethodProcess
    from harness.experiment.methods.method_run import MethodAnswers, ReferenceWorkload, describe_failure, run_method
    from harness.experiment.methods.method_worker import MethodWorker, serve
    from harness.experiment.methods.remote_method import (
        NamedMethod,
        RemoteMethod,
        close_methods,
        resolve_method,
        run_over_frames,
    )
    from harness.experiment.methods.worker_process import close_fork_server
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "DEFAULT_ISOLATION",
    "DEFAULT_TIME_LIMIT_S",
    "MAX_TEXT",
    "Arrays",
    "Header",
    "Isolation",
    "Message",
    "MethodAnswers",
    "MethodFailure",
    "MethodProcess",
    "MethodWorker",
    "NamedMethod",
    "ReferenceWorkload",
    "RemoteMethod",
    "close_fork_server",
    "close_methods",
    "describe_failure",
    "resolve_method",
    "run_method",
    "run_over_frames",
    "serve",
]
