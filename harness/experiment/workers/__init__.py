"""Workers: the tasks of a run in this process, in local processes or on Dask."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.experiment.workers.executors import TaskExecutor as TaskExecutor
    from harness.experiment.workers.executors import dask_executor as dask_executor
    from harness.experiment.workers.executors import process_executor as process_executor
    from harness.experiment.workers.executors import run_in_process as run_in_process
else:
    __getattr__, __dir__ = lazy_names(__name__)
