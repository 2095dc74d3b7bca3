"""Captured motion onto a body: the performer's own, exactly, or a common one: as closely as its proportions allow, or
with every angle kept."""

from dataclasses import dataclass

import numpy as np

from harness.body import bone_directions, ground, humanoid
from harness.body.humanoid import Body
from harness.core import humanoid24, rotations, skeleton
from harness.core.arrays import Bools, Floats
from harness.core.motion import BodyMotion, Clip
from harness.core.skeleton import Pose, Skeleton

_LEGS = ("lfemur", "ltibia", "rfemur", "rtibia")


@dataclass(frozen=True)
class RetargetReport:
    """What one clip lost on the way to a common body. Frames in stance decide about feet: NaN when there are none.

    Deviation: distance of the 24 joint centres from those of the performer, enlarged by `leg_scale`. Float and sink:
    how far soles in stance are above or below where the performer's, enlarged alike, stand over the clip's floor;
    the 95th percentile of each. "Plain" is the root scaled and every angle kept.
    """

    clip: str
    leg_scale: float
    floor_m: float
    """Height of the clip's floor that was taken out [m]."""
    stance_share: float
    """Frames with a foot in stance, of all."""
    deviation_plain_mm: float
    deviation_mm: float
    deviation_p95_mm: float
    proportions_mm: float
    """The deviation that is left when every bone, hip bones too, points exactly as the performer's."""
    float_plain_mm: float
    sink_plain_mm: float
    float_mm: float
    sink_mm: float


def retarget_to_own_body(clip: Clip) -> tuple[Body, BodyMotion]:
    """The clip on the body scaled to its own skeleton: nothing is changed, fingers and toes are left out."""
    own, angles_rad = _humanoid_part(clip)
    return humanoid.build_body(own), _body_motion(clip, humanoid24.pack(clip.root_m, clip.world_from_root, angles_rad))


def retarget_to_common_body(clip: Clip, target: Skeleton) -> tuple[BodyMotion, RetargetReport]:
    """The clip on the body of another skeleton, and what that cost.

    The root's path grows with the legs. Bones point as the performer's do where their hinges allow it. The root
    then moves by one constant offset in its own frame, that of least squared joint deviation, and by a slowly
    varying height that puts soles in stance where the performer's are, over a floor at z = 0.
    """
    own, kept_rad = _humanoid_part(clip)
    turns = clip.world_from_root
    meant = _RetargetGoal.on(target, own, kept_rad, clip)
    angles_rad = bone_directions.match_bone_directions(own, humanoid24.pack(clip.root_m, turns, kept_rad), target)
    turned = skeleton.world_rotations(target, turns, angles_rad)
    moved = skeleton.pose_from_rotations(target, meant.root_m, turned)
    root_m = meant.root_m + _best_offset_m(meant.joints_m - moved.end_m, turns)
    moved = skeleton.pose_from_rotations(target, root_m, turned)
    root_m[:, 2] += ground.smooth_sole_error(
        meant.soles_m - ground.sole_heights_m(target, moved), meant.standing, clip.rate_hz
    )
    moved = skeleton.pose_from_rotations(target, root_m, turned)
    return _body_motion(clip, humanoid24.pack(root_m, turns, angles_rad)), meant.report(moved)


def retarget_with_same_angles(clip: Clip, target: Skeleton) -> tuple[BodyMotion, RetargetReport]:
    """The clip's own angles, to the bit, on the body of another skeleton, and what that cost.

    The root's path grows with the legs and is lowered once, so that half of the soles in stance are below where the
    performer's are over a floor at z = 0 and half above. Hands and feet are then not where the performer's were.
    """
    own, angles_rad = _humanoid_part(clip)
    turns = clip.world_from_root
    meant = _RetargetGoal.on(target, own, angles_rad, clip)
    moved = skeleton.forward_kinematics(target, meant.root_m, turns, angles_rad)
    soles_m = (ground.sole_heights_m(target, moved) - meant.soles_m)[meant.standing]
    root_m = meant.root_m - np.array([0.0, 0.0, np.median(soles_m) if soles_m.size else 0.0])
    moved = skeleton.pose_from_rotations(target, root_m, moved.world_from_bone)
    return _body_motion(clip, humanoid24.pack(root_m, turns, angles_rad)), meant.report(moved)


@dataclass(frozen=True, eq=False)
class _RetargetGoal:
    """What a clip asks of a common body: the performer's joints and soles, enlarged by the legs, over z = 0."""

    clip: Clip
    own: Skeleton
    kept_rad: Floats
    """(T, 48) the clip's angles."""
    target: Skeleton
    seen: Pose
    """The clip on its own skeleton."""
    standing: Bools
    """(T, 2) feet in stance."""
    floor_m: float
    scale: float
    root_m: Floats
    """(T, 3)"""
    joints_m: Floats
    """(T, 24, 3)"""
    soles_m: Floats
    """(T, 2)"""

    @classmethod
    def on(cls, target: Skeleton, own: Skeleton, kept_rad: Floats, clip: Clip) -> "_RetargetGoal":
        seen = skeleton.forward_kinematics(own, clip.root_m, clip.world_from_root, kept_rad)
        soles_m, standing = ground.sole_heights_m(own, seen), ground.detect_stance(own, seen, clip.rate_hz)
        floor_m, scale = ground.floor_m(soles_m, standing), _leg_m(target) / _leg_m(own)
        level_m = np.array([0.0, 0.0, floor_m])
        root_m, joints_m = scale * (clip.root_m - level_m), scale * (seen.end_m - level_m)
        low_m = scale * (soles_m - floor_m)
        return cls(clip, own, kept_rad, target, seen, standing, floor_m, scale, root_m, joints_m, low_m)

    def report(self, moved: Pose) -> RetargetReport:
        """How far a motion of the common body is from it."""
        clip, target, scale = self.clip, self.target, self.scale
        plain = skeleton.forward_kinematics(target, scale * clip.root_m, clip.world_from_root, self.kept_rad)
        deviation_mm = 1e3 * np.linalg.norm(moved.end_m - self.joints_m, axis=2)
        feet_mm, plain_feet_mm = (
            1e3 * (ground.sole_heights_m(target, pose) - self.soles_m)[self.standing] for pose in (moved, plain)
        )
        return RetargetReport(
            clip=clip.name,
            leg_scale=scale,
            floor_m=self.floor_m,
            stance_share=float(np.mean(np.any(self.standing, axis=1))),
            deviation_plain_mm=float(1e3 * np.mean(np.linalg.norm(plain.end_m - scale * self.seen.end_m, axis=2))),
            deviation_mm=float(np.mean(deviation_mm)),
            deviation_p95_mm=float(np.percentile(deviation_mm, 95)),
            proportions_mm=_proportions_mm(self.own, self.seen, target, scale, clip),
            float_plain_mm=_percentile95(plain_feet_mm),
            sink_plain_mm=_percentile95(-plain_feet_mm),
            float_mm=_percentile95(feet_mm),
            sink_mm=_percentile95(-feet_mm),
        )


def _humanoid_part(clip: Clip) -> tuple[Skeleton, Floats]:
    """The 24 bones of the clip's skeleton and their (T, 48) angles; UnknownName or BadInput if it has not got them."""
    own, dofs = clip.skeleton.subset(humanoid24.BONES)
    humanoid.require_humanoid(own)
    return own, clip.angles_rad[:, dofs]


def _best_offset_m(residual_m: Floats, world_from_root: Floats) -> Floats:
    """(T, 3) the move, constant in the root's frame, that leaves the least of residuals (T, B, 3) in square [m]."""
    in_root = rotations.rotate(rotations.inverse(world_from_root), np.mean(residual_m, axis=1))
    return rotations.rotate(world_from_root, np.mean(in_root, axis=0))


def _proportions_mm(own: Skeleton, seen: Pose, target: Skeleton, scale: float, clip: Clip) -> float:
    """Mean deviation if every bone, hip bones too, could point exactly as the performer's: lengths alone [mm]."""
    ends_m = np.empty_like(seen.end_m)
    for bone, parent in enumerate(target.parents):
        at = scale * clip.root_m if parent < 0 else ends_m[:, parent]
        stretch = target.length_m[bone] / own.length_m[bone] if own.length_m[bone] > 0.0 else 0.0
        ends_m[:, bone] = at + stretch * (seen.end_m[:, bone] - seen.start_m[:, bone])
    residual_m = scale * seen.end_m - ends_m
    residual_m -= _best_offset_m(residual_m, clip.world_from_root)[:, None]
    return float(1e3 * np.mean(np.linalg.norm(residual_m, axis=2)))


def _percentile95(error_mm: Floats) -> float:
    """The 95th percentile, not below 0; NaN of nothing."""
    return max(0.0, float(np.percentile(error_mm, 95))) if error_mm.size else float("nan")


def _leg_m(own: Skeleton) -> float:
    return float(sum(own.length_m[own.index(bone)] for bone in _LEGS) / 2)


def _body_motion(clip: Clip, qpos: Floats) -> BodyMotion:
    return BodyMotion(clip.name, clip.subject, clip.source, clip.behaviour, clip.rate_hz, qpos)
