"""Methods in processes of their own: start, requests and answers, limits."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.experiment.methods.isolation import DEFAULT_ISOLATION as DEFAULT_ISOLATION
    from harness.experiment.methods.isolation import DEFAULT_TIME_LIMIT_S as DEFAULT_TIME_LIMIT_S
    from harness.experiment.methods.isolation import Isolation as Isolation
    from harness.experiment.methods.method_messages import MAX_TEXT as MAX_TEXT
    from harness.experiment.methods.method_messages import Arrays as Arrays
    from harness.experiment.methods.method_messages import Header as Header
    from harness.experiment.methods.method_messages import Message as Message
    from harness.experiment.methods.method_process import MethodFailure as MethodFailure
    from harness.experiment.methods.method_process import MethodProcess as MethodProcess
    from harness.experiment.methods.method_run import MethodAnswers as MethodAnswers
    from harness.experiment.methods.method_run import ReferenceWorkload as ReferenceWorkload
    from harness.experiment.methods.method_run import describe_failure as describe_failure
    from harness.experiment.methods.method_run import run_method as run_method
    from harness.experiment.methods.method_worker import MethodWorker as MethodWorker
    from harness.experiment.methods.method_worker import serve as serve
    from harness.experiment.methods.remote_method import NamedMethod as NamedMethod
    from harness.experiment.methods.remote_method import RemoteMethod as RemoteMethod
    from harness.experiment.methods.remote_method import close_methods as close_methods
    from harness.experiment.methods.remote_method import resolve_method as resolve_method
    from harness.experiment.methods.remote_method import run_over_frames as run_over_frames
    from harness.experiment.methods.worker_process import close_fork_server as close_fork_server
else:
    __getattr__, __dir__ = lazy_names(__name__)
