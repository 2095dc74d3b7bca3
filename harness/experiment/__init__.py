"""From scenarios to cells to results: read, plan, evaluate, store."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.experiment.calibration_session import CalibrationSession as CalibrationSession
    from harness.experiment.cells import clear_caches as clear_caches
    from harness.experiment.cells import evaluate_cell as evaluate_cell
    from harness.experiment.clip_evaluation import ClipEvaluation as ClipEvaluation
    from harness.experiment.clip_simulation import simulate_clip as simulate_clip
    from harness.experiment.engine import BatchResults as BatchResults
    from harness.experiment.engine import run as run
    from harness.experiment.engine import run_cells as run_cells
    from harness.experiment.engine import run_sweep as run_sweep
    from harness.experiment.evaluation import Evaluation as Evaluation
    from harness.experiment.evaluation import check_methods as check_methods
    from harness.experiment.evaluation import evaluate as evaluate
    from harness.experiment.evaluation import evaluate_each as evaluate_each
    from harness.experiment.observed_take import ObservedTake as ObservedTake
    from harness.experiment.observed_take import simulated_take as simulated_take
    from harness.experiment.plan import check_names as check_names
    from harness.experiment.playback import Playback as Playback
    from harness.experiment.playback import prepare_playback as prepare_playback
    from harness.experiment.playback import select_stations as select_stations
    from harness.experiment.recorded_takes import checked_note as checked_note
    from harness.experiment.recorded_takes import find_playback as find_playback
    from harness.experiment.recorded_takes import has_station_names as has_station_names
    from harness.experiment.recorded_takes import name_recorded_stations as name_recorded_stations
    from harness.experiment.recorded_takes import recorded_take as recorded_take
    from harness.experiment.recorded_takes import registered_take as registered_take
    from harness.experiment.run_export import export_run as export_run
    from harness.experiment.simulated_calibration import TrackerSession as TrackerSession
    from harness.experiment.status import RunStatus as RunStatus
    from harness.experiment.status import read_status as read_status
    from harness.experiment.tasks import ClipTask as ClipTask
    from harness.experiment.tasks import PlannedCell as PlannedCell
    from harness.experiment.tasks import cell_names as cell_names
    from harness.experiment.tasks import plan_tasks as plan_tasks
else:
    __getattr__, __dir__ = lazy_names(__name__)
