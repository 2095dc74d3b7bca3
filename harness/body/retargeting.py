"""Retargeting of a clip to a body: the performer's own (exact), or a common one.

On a common body either the bones point as closely as possible in the performer's directions, or all angles are kept.
"""

from dataclasses import dataclass

import numpy as np

from harness.body import ground, humanoid
from harness.body.humanoid import Body
from harness.core import humanoid24, rotations, skeleton
from harness.core.arrays import Bools, Floats
from harness.core.motion import BodyMotion, Clip
from harness.core.skeleton import Pose, Skeleton, are_gimbal, equivalent_euler_angles, hinge_angles

_LEGS = ("lfemur", "ltibia", "rfemur", "rtibia")


@dataclass(frozen=True)
class RetargetReport:
    """Errors of retargeting one clip to a common body.

    Deviation is the distance of the 24 joint centres from those of the performer, scaled by `leg_scale`. Float and sink
    are the 95th percentiles of the height of soles in stance above and below those of the performer, scaled alike, over
    the clip's floor; NaN without stance. "Plain" is the motion with the root's path scaled and every angle kept.
    """

    clip: str
    leg_scale: float
    floor_m: float
    """Height of the clip's floor, which was subtracted [m]."""
    stance_share: float
    """Share of frames with a foot in stance."""
    deviation_plain_mm: float
    deviation_mm: float
    deviation_p95_mm: float
    proportions_mm: float
    """Deviation that remains if every bone, hip bones included, points exactly as the performer's [mm]."""
    float_plain_mm: float
    sink_plain_mm: float
    float_mm: float
    sink_mm: float


def retarget_to_own_body(clip: Clip) -> tuple[Body, BodyMotion]:
    """The clip on the body scaled to its own skeleton, unchanged; fingers and toes are left out."""
    source, angles_rad = _humanoid_part(clip)
    return humanoid.build_body(source), _body_motion(
        clip, humanoid24.pack(clip.root_m, clip.world_from_root, angles_rad)
    )


def retarget_to_common_body(clip: Clip, target: Skeleton) -> tuple[BodyMotion, RetargetReport]:
    """The clip on the body of the skeleton `target` with matching bone directions, and the errors.

    The root's path scales with the legs. Bones point as the performer's where their hinges allow it. The root then
    moves by a constant offset in its own frame, of least squared joint deviation, and by a slowly varying height that
    puts soles in stance at the performer's heights over a floor at z = 0.
    """
    source, source_angles_rad = _humanoid_part(clip)
    world_from_root = clip.world_from_root
    goal = _RetargetGoal.create(target, source, source_angles_rad, clip)
    qpos = humanoid24.pack(clip.root_m, world_from_root, source_angles_rad)
    angles_rad = match_bone_directions(source, qpos, target)
    world_from_bone = skeleton.world_rotations(target, world_from_root, angles_rad)
    pose = skeleton.pose_from_rotations(target, goal.root_m, world_from_bone)
    root_m = goal.root_m + _best_offset_m(goal.joints_m - pose.end_m, world_from_root)
    pose = skeleton.pose_from_rotations(target, root_m, world_from_bone)
    sole_error_m = goal.soles_m - ground.sole_heights_m(target, pose)
    root_m[:, 2] += ground.smooth_sole_error(sole_error_m, goal.stance, clip.rate_hz)
    pose = skeleton.pose_from_rotations(target, root_m, world_from_bone)
    return _body_motion(clip, humanoid24.pack(root_m, world_from_root, angles_rad)), goal.report(pose)


def retarget_with_same_angles(clip: Clip, target: Skeleton) -> tuple[BodyMotion, RetargetReport]:
    """The clip with its angles unchanged on the body of the skeleton `target`, and the errors.

    The root's path scales with the legs and is shifted once in height, so that the median height of soles in stance is
    the performer's over a floor at z = 0. Hands and feet are not at the performer's positions.
    """
    source, angles_rad = _humanoid_part(clip)
    goal = _RetargetGoal.create(target, source, angles_rad, clip)
    pose = skeleton.forward_kinematics(target, goal.root_m, clip.world_from_root, angles_rad)
    soles_m = (ground.sole_heights_m(target, pose) - goal.soles_m)[goal.stance]
    root_m = goal.root_m - np.array([0.0, 0.0, np.median(soles_m) if soles_m.size else 0.0])
    pose = skeleton.pose_from_rotations(target, root_m, pose.world_from_bone)
    return _body_motion(clip, humanoid24.pack(root_m, clip.world_from_root, angles_rad)), goal.report(pose)


@dataclass(frozen=True, eq=False)
class _RetargetGoal:
    """Targets on a common body: the performer's joints and soles, scaled by the legs, over a floor at z = 0."""

    clip: Clip
    source: Skeleton
    angles_rad: Floats
    """(T, 48) the clip's angles [rad]."""
    target: Skeleton
    pose: Pose
    """Pose of the clip on its own skeleton."""
    stance: Bools
    """(T, 2) whether each foot is in stance."""
    floor_m: float
    scale: float
    root_m: Floats
    """(T, 3) target of the root [m]."""
    joints_m: Floats
    """(T, 24, 3) targets of the bones' far ends [m]."""
    soles_m: Floats
    """(T, 2) targets of the sole heights [m]."""

    @classmethod
    def create(cls, target: Skeleton, source: Skeleton, angles_rad: Floats, clip: Clip) -> "_RetargetGoal":
        """Targets for a clip with the angles `angles_rad` (T, 48) on the performer's skeleton."""
        pose = skeleton.forward_kinematics(source, clip.root_m, clip.world_from_root, angles_rad)
        soles_m, stance = ground.sole_heights_m(source, pose), ground.detect_stance(source, pose, clip.rate_hz)
        floor_m, scale = ground.floor_m(soles_m, stance), _leg_m(target) / _leg_m(source)
        level_m = np.array([0.0, 0.0, floor_m])
        root_m, joints_m = scale * (clip.root_m - level_m), scale * (pose.end_m - level_m)
        soles_m = scale * (soles_m - floor_m)
        return cls(clip, source, angles_rad, target, pose, stance, floor_m, scale, root_m, joints_m, soles_m)

    def report(self, result: Pose) -> RetargetReport:
        """Errors of a motion of the common body against the targets."""
        clip, target, scale = self.clip, self.target, self.scale
        plain = skeleton.forward_kinematics(target, scale * clip.root_m, clip.world_from_root, self.angles_rad)
        deviation_mm = 1e3 * np.linalg.norm(result.end_m - self.joints_m, axis=2)
        feet_mm, plain_feet_mm = (
            1e3 * (ground.sole_heights_m(target, pose) - self.soles_m)[self.stance] for pose in (result, plain)
        )
        return RetargetReport(
            clip=clip.name,
            leg_scale=scale,
            floor_m=self.floor_m,
            stance_share=float(np.mean(np.any(self.stance, axis=1))),
            deviation_plain_mm=float(1e3 * np.mean(np.linalg.norm(plain.end_m - scale * self.pose.end_m, axis=2))),
            deviation_mm=float(np.mean(deviation_mm)),
            deviation_p95_mm=float(np.percentile(deviation_mm, 95)),
            proportions_mm=_proportions_mm(self.source, self.pose, target, scale, clip),
            float_plain_mm=_percentile95(plain_feet_mm),
            sink_plain_mm=_percentile95(-plain_feet_mm),
            float_mm=_percentile95(feet_mm),
            sink_mm=_percentile95(-feet_mm),
        )


def _humanoid_part(clip: Clip) -> tuple[Skeleton, Floats]:
    """The 24 bones of the clip's skeleton and their angles (T, 48) [rad]; UnknownName or BadInput if it lacks them."""
    source, dofs = humanoid24.select_bones(clip.skeleton)
    humanoid.require_humanoid(source)
    return source, clip.angles_rad[:, dofs]


def _best_offset_m(residual_m: Floats, world_from_root: Floats) -> Floats:
    """(T, 3) offset, constant in the root's frame, that minimises the squared residuals (T, B, 3) [m]."""
    in_root = rotations.rotate(rotations.inverse(world_from_root), np.mean(residual_m, axis=1))
    return rotations.rotate(world_from_root, np.mean(in_root, axis=0))


def _proportions_mm(source: Skeleton, pose: Pose, target: Skeleton, scale: float, clip: Clip) -> float:
    """Mean deviation from bone lengths alone, if every bone pointed exactly as the performer's [mm]."""
    ends_m = np.empty_like(pose.end_m)
    for bone, parent in enumerate(target.parents):
        at = scale * clip.root_m if parent < 0 else ends_m[:, parent]
        stretch = target.length_m[bone] / source.length_m[bone] if source.length_m[bone] > 0.0 else 0.0
        ends_m[:, bone] = at + stretch * (pose.end_m[:, bone] - pose.start_m[:, bone])
    residual_m = scale * pose.end_m - ends_m
    residual_m -= _best_offset_m(residual_m, clip.world_from_root)[:, None]
    return float(1e3 * np.mean(np.linalg.norm(residual_m, axis=2)))


def _percentile95(error_mm: Floats) -> float:
    """The 95th percentile, at least 0; NaN for an empty array."""
    return max(0.0, float(np.percentile(error_mm, 95))) if error_mm.size else float("nan")


def _leg_m(skeleton: Skeleton) -> float:
    return float(sum(skeleton.length_m[skeleton.index(bone)] for bone in _LEGS) / 2)


def _body_motion(clip: Clip, qpos: Floats) -> BodyMotion:
    return BodyMotion(clip.name, clip.subject, clip.source, clip.behaviour, clip.rate_hz, qpos)


def match_bone_directions(source: Skeleton, qpos: Floats, target: Skeleton) -> Floats:
    """Hinge angles (T, 48) with which the bones of `target` point as those of `source` do at `qpos` (T, 55) [rad].

    Bones with the same direction in both rest poses keep their angles. A bone with three hinges is oriented exactly. A
    bone with fewer hinges is oriented as closely as they allow, within the joint limits unless the source angle is
    outside. Of equivalent angles, the one nearest to the source angle is chosen.
    """
    _, world_from_root, angles_rad = humanoid24.unpack(qpos)
    source_rotation = skeleton.forward_kinematics(source, *humanoid24.unpack(qpos)).world_from_bone
    root, limits_rad = rotations.to_matrix(world_from_root), humanoid24.limits_rad()
    out, target_rotation = np.array(angles_rad), np.empty_like(source_rotation)
    for bone, parent in enumerate(target.parents):
        above = root if parent < 0 else target_rotation[:, parent]
        dofs = target.dof_of_bone[bone]
        start, axes = angles_rad[:, dofs], target.axes[dofs]
        if len(axes):
            rotation = source_rotation[:, bone] @ _shortest_rotation(target.bone_m[bone], source.bone_m[bone])
            local = np.swapaxes(above, 1, 2) @ rotation
            fitted = _nearest_euler_angles(axes, hinge_angles(axes, rotations.from_matrix(local)), start)
            if len(axes) < 3:
                low, high = limits_rad[dofs].T
                fitted = np.clip(fitted, np.minimum(low, start), np.maximum(high, start))
            out[:, dofs] = fitted
        target_rotation[:, bone] = above @ skeleton.local_rotation(target, bone, out)
    return out


def _shortest_rotation(a: Floats, b: Floats) -> Floats:
    """Shortest rotation (3, 3) of direction a to b, which are not opposite; the identity for a zero vector."""
    lengths = np.sqrt((a @ a) * (b @ b))
    if lengths == 0.0:
        return np.eye(3)
    half = np.concatenate([[1.0 + a @ b / lengths], np.cross(a, b) / lengths])
    return rotations.to_matrix(half / np.sqrt(half @ half))


def _nearest_euler_angles(axes: Floats, angle_rad: Floats, near_rad: Floats) -> Floats:
    """Angles (T, N) of the same rotations that are nearest to `near_rad` [rad]."""
    first = _nearest_turn(angle_rad, near_rad)
    if not are_gimbal(axes):
        return first
    second = _nearest_turn(equivalent_euler_angles(angle_rad), near_rad)
    closer = np.sum((first - near_rad) ** 2, axis=1) <= np.sum((second - near_rad) ** 2, axis=1)
    out: Floats = np.where(closer[:, None], first, second)
    return out


def _nearest_turn(angle_rad: Floats, near_rad: Floats) -> Floats:
    """Angles with whole turns added, so that they lie within half a turn of `near_rad` [rad]."""
    out: Floats = angle_rad - 2 * np.pi * np.round((angle_rad - near_rad) / (2 * np.pi))
    return out
