"""Workers: the tasks of a run in this process, in local processes or on Dask."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.experiment.workers.executors import TaskExecutor, dask_executor, process_executor, run_in_process
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = ["TaskExecutor", "dask_executor", "process_executor", "run_in_process"]
