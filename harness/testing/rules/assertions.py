"""Assertions that the rules share; they raise `RuleViolation`."""

import numpy as np

from harness.core.arrays import Floats
from harness.core.estimate import Estimate, Origin, Status
from harness.testing.contract_case import ContractCase, Frames


class RuleViolation(Exception):
    """A rule does not hold; the message describes the fault."""


def require_poses(case: ContractCase, frames: Frames) -> str:
    """Require valid poses of a new session; returns the number of frames as text."""
    for index, estimate in enumerate(case.steps(frames)):
        require_pose(case, index, estimate)
    return f"{len(frames)} frames"


def require_pose(case: ContractCase, index: int, estimate: Estimate) -> None:
    """Require a finite configuration (55,) with a unit root quaternion near the stations, a status and an origin."""
    qpos = np.asarray(estimate.qpos)
    if qpos.shape != (55,) or not np.all(np.isfinite(qpos)):
        count = np.count_nonzero(~np.isfinite(qpos))
        raise RuleViolation(f"qpos in frame {index} has shape {qpos.shape} and {count} non-finite numbers")
    if abs(float(np.linalg.norm(qpos[3:7])) - 1.0) > 1e-6:
        raise RuleViolation(f"the root quaternion in frame {index} has length {np.linalg.norm(qpos[3:7]):.6f}")
    if np.any(qpos[:3] < case.bounds[0]) or np.any(qpos[:3] > case.bounds[1]):
        raise RuleViolation(f"the root in frame {index} is at {np.round(qpos[:3], 2)}, far from every station")
    if not isinstance(estimate.status, Status):
        raise RuleViolation(f"the status in frame {index} is {estimate.status!r}, not a Status")
    if not isinstance(estimate.origin, Origin):
        raise RuleViolation(f"the origin in frame {index} is {estimate.origin!r}, not an Origin")


def require_identical(qpos: Floats, expected_qpos: Floats, verb: str = "differ") -> str:
    """Require two sets of estimates (F, 55) to be identical to the bit; `verb` describes the fault."""
    differing = np.flatnonzero(np.any(qpos != expected_qpos, axis=1))
    if len(differing):
        most = float(np.max(np.abs(qpos - expected_qpos)))
        raise RuleViolation(
            f"{len(differing)} estimates {verb}, the first in frame {differing[0]}, by up to {most:.3g}"
        )
    return f"{len(qpos)} estimates are identical to the bit"
