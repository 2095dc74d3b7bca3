"""Approximate pose of a performer who has no calibration yet, for a picture next to the pose that is wanted.

Stations are taken to sit at their nominal mounts; orientations are not used. The pose is the maximum a posteriori one
by Gauss-Newton, with the wanted pose as prior: what no position determines looks as it should.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.body import Body, Kinematics, Mount, locate_mounts, pose_from_qpos, sole_heights_m
from harness.calibrate.pose_classifier import PoseClassifier
from harness.core.arrays import Floats
from harness.stream import TrackerFrame

_POSITION_SD_M, _HINGE_SD_RAD = 0.02, float(np.deg2rad(30.0))
"""Standard deviations of a station's position and of a hinge about the wanted pose [m, rad] [choice]."""
_STEPS, _LARGEST_STEP_RAD = 8, 0.5
_ROOT = 6
"""Number of the root's velocities in MuJoCo's order; hinges follow."""


@dataclass(frozen=True, eq=False)
class PerformerPose:
    """The performer's approximate pose, and how far it is from the wanted one."""

    qpos: Floats
    """(55,) configuration on the displayed body, its lower sole on the floor."""
    distance_m: Floats
    """(S,) distance of each station from its place in the wanted pose, at the best place, heading and size [m]."""


class PerformerPreview:
    """Poses of a performer who wears stations (S,) at these mounts, drawn on a body that is not their own."""

    def __init__(
        self, body: Body, mounts: Sequence[Mount], poses: Sequence[Floats], classifier: PoseClassifier
    ) -> None:
        """`poses` (55,) are the wanted configurations, and those of the classifier."""
        self._body, self._poses, self._classifier = body, poses, classifier
        self._kinematics = Kinematics(body)
        self._bones, self._mount_m, self._turn = locate_mounts(body.skeleton, mounts)
        self._last_m: Floats | None = None

    def estimate(self, pose: int, frame: TrackerFrame) -> PerformerPose | None:
        """The pose in a frame while another is wanted; None until every station has reported a position.

        A station without a reading keeps its last position.
        """
        valid = frame.position_valid[:, None]
        before_m = np.full(frame.position_m.shape, np.nan) if self._last_m is None else self._last_m
        self._last_m = np.where(valid, frame.position_m, before_m)
        if not np.isfinite(self._last_m).all():
            return None
        place_m, distance_m = self._classifier.aligned_m(pose, self._last_m)
        return PerformerPose(self._fit(self._poses[pose], place_m), distance_m)

    def _fit(self, wanted: Floats, place_m: Floats) -> Floats:
        kinematics_, qpos = self._kinematics, np.array(wanted)
        linear, angular = np.zeros((2, len(self._bones), 3, kinematics_.nv))
        prior = np.zeros(kinematics_.nv)
        prior[_ROOT:] = _HINGE_SD_RAD**-2
        prior[:_ROOT] = 1e-6
        for _ in range(_STEPS):
            kinematics_.set(qpos)
            reached_m, _ = kinematics_.station_poses(self._bones, self._mount_m, self._turn)
            kinematics_.jacobians(self._bones, reached_m, linear, angular)
            slope = linear.reshape(-1, kinematics_.nv) / _POSITION_SD_M
            away = np.zeros(kinematics_.nv)
            away[_ROOT:] = (wanted - qpos)[_ROOT + 1 :]
            right = slope.T @ ((place_m - reached_m).ravel() / _POSITION_SD_M) + prior * away
            step: Floats = np.asarray(np.linalg.solve(slope.T @ slope + np.diag(prior), right), dtype=float)
            step *= min(1.0, _LARGEST_STEP_RAD / max(float(np.abs(step).max()), 1e-9))
            qpos = kinematics_.integrate(qpos, step)
        skeleton = self._body.skeleton
        soles_m = sole_heights_m(skeleton, pose_from_qpos(skeleton, qpos[None]))
        qpos[2] -= float(soles_m.min())
        return qpos
