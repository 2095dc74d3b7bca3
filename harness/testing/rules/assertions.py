"""What a rule sees: `RuleViolation` where it is not kept, and the two things that many of them look for."""

import numpy as np

from harness.core.arrays import Floats
from harness.core.estimate import Estimate, Status
from harness.testing.contract_case import ContractCase, Frames


class RuleViolation(Exception):
    """What was seen of a rule that is not kept."""


def require_poses(trial: ContractCase, frames: Frames) -> str:
    """Every answer of a new session is a pose, and how many there were."""
    for index, estimate in enumerate(trial.run(frames)):
        require_pose(trial, index, estimate)
    return f"{len(frames)} frames"


def require_pose(trial: ContractCase, index: int, estimate: Estimate) -> None:
    """Finite, of unit quaternion, near the stations, with a status."""
    qpos = np.asarray(estimate.qpos)
    if qpos.shape != (55,) or not np.all(np.isfinite(qpos)):
        wrong = np.count_nonzero(~np.isfinite(qpos))
        raise RuleViolation(f"frame {index} has {wrong} numbers that are not finite, of {qpos.shape}")
    if abs(float(np.linalg.norm(qpos[3:7])) - 1.0) > 1e-6:
        raise RuleViolation(f"frame {index} has a root quaternion of length {np.linalg.norm(qpos[3:7]):.6f}")
    if np.any(qpos[:3] < trial.bounds[0]) or np.any(qpos[:3] > trial.bounds[1]):
        raise RuleViolation(f"frame {index} puts the root at {np.round(qpos[:3], 2)}, far from every station")
    if not isinstance(estimate.status, Status):
        raise RuleViolation(f"frame {index} has the status {estimate.status!r}")


def require_identical(one: Floats, other: Floats, how: str = "differ") -> str:
    """(F, 55) answers and those that should be the same, to the bit."""
    differing = np.flatnonzero(np.any(one != other, axis=1))
    if len(differing):
        most = float(np.max(np.abs(one - other)))
        raise RuleViolation(f"{len(differing)} answers {how}, the first in frame {differing[0]}, by up to {most:.3g}")
    return f"{len(one)} answers to the bit"
