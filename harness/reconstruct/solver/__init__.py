"""Solvers for the configuration that explains the readings of a frame."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.reconstruct.solver.frame_reader import SessionReader
    from harness.reconstruct.solver.ground_frame import POSTURE_SIZE
    from harness.reconstruct.solver.hinge_limits import HingeLimits
    from harness.reconstruct.solver.ik_solver import IKSolver, Prior, Stopping
    from harness.reconstruct.solver.outlier_gate import OutlierGate
    from harness.reconstruct.solver.reading_prediction import OLDEST_S
    from harness.reconstruct.solver.residuals import Loss, Residuals
    from harness.reconstruct.solver.status_monitor import StatusMonitor
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "OLDEST_S",
    "POSTURE_SIZE",
    "HingeLimits",
    "IKSolver",
    "Loss",
    "OutlierGate",
    "Prior",
    "Residuals",
    "SessionReader",
    "StatusMonitor",
    "Stopping",
]
