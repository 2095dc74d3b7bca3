"""From scenarios to cells to results: read, plan, evaluate, store."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.experiment.calibration_session import CalibrationSession
    from harness.experiment.cells import clear_caches, evaluate_cell
    from harness.experiment.clip_evaluation import ClipEvaluation
    from harness.experiment.clip_simulation import simulate_clip
    from harness.experiment.engine import BatchResults, run, run_cells, run_sweep
    from harness.experiment.evaluation import Evaluation, check_methods, evaluate, evaluate_each
    from harness.experiment.observed_take import ObservedTake, simulated_take
    from harness.experiment.plan import check_names
    from harness.experiment.playback import Playback, prepare_playback, select_stations
    from harness.experiment.recorded_takes import (
        checked_note,
        find_playback,
        has_station_names,
        name_recorded_stations,
        recorded_take,
        registered_take,
    )
    from harness.experiment.run_export import export_run
    from harness.experiment.simulated_calibration import TrackerSession
    from harness.experiment.status import RunStatus, read_status
    from harness.experiment.tasks import ClipTask, PlannedCell, cell_names, plan_tasks
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "BatchResults",
    "CalibrationSession",
    "ClipEvaluation",
    "ClipTask",
    "Evaluation",
    "ObservedTake",
    "PlannedCell",
    "Playback",
    "RunStatus",
    "TrackerSession",
    "cell_names",
    "check_methods",
    "check_names",
    "checked_note",
    "clear_caches",
    "evaluate",
    "evaluate_cell",
    "evaluate_each",
    "export_run",
    "find_playback",
    "has_station_names",
    "name_recorded_stations",
    "plan_tasks",
    "prepare_playback",
    "read_status",
    "recorded_take",
    "registered_take",
    "run",
    "run_cells",
    "run_sweep",
    "select_stations",
    "simulate_clip",
    "simulated_take",
]
