"""Solvers for the configuration that explains the readings of a frame."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.reconstruct.solver.frame_reader import SessionReader as SessionReader
    from harness.reconstruct.solver.ground_frame import POSTURE_SIZE as POSTURE_SIZE
    from harness.reconstruct.solver.hinge_limits import HingeLimits as HingeLimits
    from harness.reconstruct.solver.ik_solver import IKSolver as IKSolver
    from harness.reconstruct.solver.ik_solver import Prior as Prior
    from harness.reconstruct.solver.ik_solver import Stopping as Stopping
    from harness.reconstruct.solver.outlier_gate import OutlierGate as OutlierGate
    from harness.reconstruct.solver.reading_prediction import OLDEST_S as OLDEST_S
    from harness.reconstruct.solver.residuals import Loss as Loss
    from harness.reconstruct.solver.residuals import Residuals as Residuals
    from harness.reconstruct.solver.status_monitor import StatusMonitor as StatusMonitor
else:
    __getattr__, __dir__ = lazy_names(__name__)
