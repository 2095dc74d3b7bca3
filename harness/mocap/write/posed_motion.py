"""Truth and estimate of a cell as posed skeletons, the common input of all export formats."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.humanoid24 import QPOS_OF_DOF, standard_skeleton, unpack
from harness.core.skeleton import Skeleton, forward_kinematics


class ExportableCell(Protocol):
    """The part of a run's cell that is exported: F frames (see `harness.results.cell.Cell`)."""

    @property
    def key(self) -> str: ...
    @property
    def method(self) -> str: ...
    @property
    def clip(self) -> str: ...
    @property
    def inputs(self) -> str: ...
    @property
    def rate_hz(self) -> float: ...
    @property
    def bone_m(self) -> Floats: ...
    @property
    def estimate_bone_m(self) -> Floats: ...
    @property
    def time_s(self) -> Floats: ...
    @property
    def frame_index(self) -> Ints: ...
    @property
    def status(self) -> Ints: ...
    @property
    def truth_qpos(self) -> Floats: ...
    @property
    def estimate_qpos(self) -> Floats: ...
    @property
    def angle_sigma_rad(self) -> Floats | None: ...
    @property
    def errors(self) -> Mapping[str, Floats]: ...


@dataclass(frozen=True, eq=False)
class PosedMotion:
    """F posed frames in world axes (x forward, y left, z up), metres and radians."""

    skeleton: Skeleton
    rate_hz: float
    frame_index: Ints
    """(F,) strictly increasing; a step of more than one is a gap."""
    time_s: Floats
    """(F,) [s]."""
    world_from_root: Floats
    """(F, 4) unit quaternion (w, x, y, z)."""
    angles_rad: Floats
    """(F, D) hinge angles [rad]."""
    joints_m: Floats
    """(F, B + 1, 3) positions of the root, then of each bone's far end [m]."""
    world_from_bone: Floats
    """(F, B, 3, 3) rotation matrices."""
    extra: Mapping[str, Floats]
    """(F,) additional columns of a table, by name."""

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """(B + 1,) names of `joints_m`; a bone's name stands for its far end."""
        return ("root", *self.skeleton.names)


def pose_truth_and_estimate(cell: ExportableCell) -> dict[str, PosedMotion]:
    """Truth and estimate of a cell, each on its own skeleton, in the frames with a finite estimate."""
    finite = np.isfinite(cell.estimate_qpos).all(axis=1)
    extra = {"status": cell.status[finite].astype(float)} | {name: e[finite] for name, e in cell.errors.items()}
    if cell.angle_sigma_rad is not None:
        sigma_deg = np.rad2deg(cell.angle_sigma_rad[finite][:, QPOS_OF_DOF])
        names = standard_skeleton().dof_names
        extra |= {f"{name}_sigma_deg": column for name, column in zip(names, sigma_deg.T, strict=True)}
    time_s, frame_index = cell.time_s[finite], cell.frame_index[finite]

    def motion(qpos: Floats, bone_m: Floats, extra: Mapping[str, Floats]) -> PosedMotion:
        skeleton = standard_skeleton().with_bones(bone_m)
        root_m, quaternion, angles_rad = unpack(qpos[finite])
        world_from_root = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
        pose = forward_kinematics(skeleton, root_m, world_from_root, angles_rad)
        joints_m = np.concatenate([root_m[:, None], pose.end_m], axis=1)
        return PosedMotion(
            skeleton, cell.rate_hz, frame_index, time_s, rotations.continuous(world_from_root),
            angles_rad, joints_m, pose.world_from_bone, extra,
        )  # fmt: skip

    return {
        "truth": motion(cell.truth_qpos, cell.bone_m, {}),
        "estimate": motion(cell.estimate_qpos, cell.estimate_bone_m, extra),
    }
