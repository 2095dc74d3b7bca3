"""Inverse kinematics of the whole body: 48 hinge angles for targets of trunk, feet and hands, all frames at once."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.mocap.synthetic import limb_ik
from harness.mocap.synthetic.curves import smooth_maximum, smooth_minimum
from harness.mocap.synthetic.limb_ik import axis_rotation, horizontal_vector, normalize, rotate_vectors, stack_columns
from harness.mocap.synthetic.performers import PostureOffsets

WristAngles = tuple[Floats, Floats]
SIDES = ("l", "r")
SIDE_SIGN = {"l": 1.0, "r": -1.0}
"""Sign of a side along the world's y."""

_SPINE_SHARES = {"lowerback": (0.40, 0.28, 0.40), "upperback": (0.33, 0.42, 0.32), "thorax": (0.27, 0.30, 0.28)}
"""Share of the chest's bend, twist and lean in each back bone; the low back bends most and twists least."""
_NECK_SHARES = {"lowerneck": (0.40, 0.30, 0.40), "upperneck": (0.40, 0.45, 0.40), "head": (0.20, 0.25, 0.20)}
_NECK_BIAS_RAD = {"lowerneck": -0.28, "upperneck": 0.20, "head": 0.08}
"""S-shape of the neck with a level gaze, near the medians of real clips [rad]."""
_CLAVICLE_RAD = 0.16
_HANGING_ARM_FRAME = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Frame of an upper arm that hangs with the elbow bending forward, in the chest's frame (either side)."""


@dataclass(frozen=True, eq=False)
class FootTarget:
    """Target of a foot's bone over T frames."""

    toe_m: Floats
    """(T, 3) far end of the foot bone, the ball of the foot."""
    direction: Floats
    """(T, 3) unit vector from ankle to ball."""
    knee: Floats
    """(T, 3) direction in which the knee bends."""


class ArticulatedFigure:
    """A body that is posed over T frames, from the trunk outwards.

    `angles_rad` (T, 48) is complete once both legs and both arms are posed.
    """

    def __init__(
        self,
        skeleton: Skeleton,
        root_m: Floats,
        pelvis: Floats,
        spine: Floats,
        gaze: Floats,
        shoulders: Mapping[str, tuple[Floats, Floats]],
        posture_offsets: PostureOffsets,
    ) -> None:
        """Pose the trunk.

        `root_m` (T, 3) is the root's path [m]. Angles [rad]: `pelvis` (T, 3) yaw, pitch, roll; `spine` (T, 3) bend,
        twist and lean of the chest on the pelvis; `gaze` (T, 3) yaw, pitch and roll of the head in the world;
        `shoulders` lift and reach (T,) of each side; `posture_offsets` are added to hinges of back, neck and hands.
        """
        self.skeleton, self.root_m, self._posture_offsets = skeleton, root_m, posture_offsets
        self.angles_rad = np.zeros((len(root_m), len(skeleton.axes)))
        self.pelvis = limb_ik.yaw_pitch_roll_rotation(pelvis)
        self._world: dict[str, Floats] = {}
        self._end: dict[str, Floats] = {}
        rotation, joint_m = self.pelvis, root_m
        for bone, share in _SPINE_SHARES.items():
            rotation, joint_m = self._pose_trunk_bone(bone, rotation, joint_m, spine * share + posture_offsets[bone])
        self.chest, self.chest_m = rotation, joint_m
        self._pose_neck(gaze)
        for side in SIDES:
            lift, reach = (_CLAVICLE_RAD * np.tanh(x / _CLAVICLE_RAD) for x in shoulders[side])
            sign = SIDE_SIGN[side]
            self._pose_trunk_bone(
                f"{side}clavicle", self.chest, self.chest_m, np.stack([-sign * reach, sign * lift], axis=-1)
            )

    def _pose_trunk_bone(self, bone: str, parent: Floats, joint_m: Floats, angles: Floats) -> tuple[Floats, Floats]:
        """Set the hinges of a trunk bone at `joint_m`; returns its world rotation (T, 3, 3) and far end (T, 3)."""
        b = self.skeleton.index(bone)
        dofs = self.skeleton.dof_of_bone[b]
        self.angles_rad[:, dofs] = angles
        rotation = parent
        for d in reversed(range(dofs.start, dofs.stop)):
            axis = self.skeleton.axes[d]
            rotation = rotation @ axis_rotation(int(np.argmax(axis)), self.angles_rad[:, d])
        self._world[bone] = rotation
        self._end[bone] = joint_m + rotation @ self.skeleton.bone_m[b]
        return self._world[bone], self._end[bone]

    def _pose_neck(self, gaze: Floats) -> None:
        head = limb_ik.yaw_pitch_roll_rotation(gaze)
        rest = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # the neck's hinge axes y, z, x
        angles = limb_ik.euler_xyz(rest.T @ np.swapaxes(self.chest, -1, -2) @ head @ rest)
        for bone, share in _NECK_SHARES.items():
            dofs = self.skeleton.dof_of_bone[self.skeleton.index(bone)]
            self.angles_rad[:, dofs] = angles * share + self._posture_offsets[bone] + [_NECK_BIAS_RAD[bone], 0.0, 0.0]

    def shoulder_m(self, side: str) -> Floats:
        """(T, 3) shoulder joint, where the upper arm starts [m]."""
        return self._end[f"{side}clavicle"]

    def point_near_chest_m(self, yaw: Floats, ahead: Floats, left: Floats, up: Floats) -> Floats:
        """(T, 3) point at a distance ahead, left and above the top of the chest, for the heading `yaw` (T,) [rad]."""
        return self.chest_m + stack_columns(*horizontal_vector(yaw, ahead, left).T, up)

    def hip_m(self, side: str) -> Floats:
        """(T, 3) hip joint, where the thigh starts [m]."""
        hip: Floats = self.root_m + self.pelvis @ self.skeleton.bone_m[self.skeleton.index(f"{side}hipjoint")]
        return hip

    def length_m(self, bone: str) -> float:
        return float(self.skeleton.length_m[self.skeleton.index(bone)])

    def arm_m(self, side: str) -> float:
        """Length of the arm from shoulder to wrist [m]."""
        return sum(self.length_m(f"{side}{bone}") for bone in ("humerus", "radius", "wrist"))

    def _set(self, bone: str, *angles: Floats) -> None:
        self.angles_rad[:, self.skeleton.dof_of_bone[self.skeleton.index(bone)]] = np.stack(angles, axis=-1)

    def pose_leg(self, side: str, foot: FootTarget) -> None:
        """Set a leg so that its foot bone is at `foot`; the knee bends towards `foot.knee`."""
        thigh, shank = self.length_m(f"{side}femur"), self.length_m(f"{side}tibia")
        hip = self.hip_m(side)
        ankle = foot.toe_m - self.length_m(f"{side}foot") * foot.direction
        bend = foot.knee + 0.35 * self.pelvis[:, :, 0]  # a knee points between hip and foot
        knee = limb_ik.middle_joint(hip, ankle, bend, thigh, shank)
        left = normalize(np.cross(hip - ankle, bend))
        rest = limb_ik.hinge_frame(self.skeleton, f"{side}femur")
        femur, flexion = limb_ik.two_bone_angles(normalize(knee - hip), normalize(ankle - knee), left, rest)
        self._set_ball_joint(f"{side}femur", np.swapaxes(self.pelvis, -1, -2) @ femur, rest)
        self._set(f"{side}tibia", flexion)
        tibia = femur @ rest @ axis_rotation(0, flexion)
        a, c = limb_ik.universal_joint_angles(
            rest.T @ self.skeleton.bone_m[self.skeleton.index(f"{side}foot")],
            rotate_vectors(np.swapaxes(tibia, -1, -2), foot.direction),
        )
        self._set(f"{side}foot", a, c)

    def _set_ball_joint(self, bone: str, relative: Floats, rest: Floats) -> None:
        self._set(bone, *np.unwrap(limb_ik.euler_xyz(rest.T @ relative @ rest), axis=0).T)

    def pose_arm(self, side: str, upper: Floats, elbow: Floats, pronation: Floats, hand: WristAngles) -> None:
        """Set an arm by the world rotation of its upper bone (T, 3, 3) and the flexion of its elbow (T,) [rad].

        `pronation` is that of the forearm; `hand` the wrist's flexion (towards the palm) and deviation (towards the
        thumb), all (T,) [rad].
        """
        sign = SIDE_SIGN[side]
        rest = limb_ik.hinge_frame(self.skeleton, f"{side}humerus")
        parent = self._world[f"{side}clavicle"]
        self._set_ball_joint(f"{side}humerus", np.swapaxes(parent, -1, -2) @ upper, rest)
        self._set(f"{side}radius", elbow)
        self._set(f"{side}wrist", -sign * pronation + self._posture_offsets[f"{side}wrist"][:, 0])
        offset = self._posture_offsets[f"{side}hand"]
        self._set(f"{side}hand", hand[0] + offset[:, 0], -sign * hand[1] + offset[:, 1])

    def pose_hanging_arm(
        self,
        side: str,
        swing: Floats,
        spread: Floats,
        twist: Floats,
        elbow: Floats,
        pronation: Floats,
        hand: WristAngles,
    ) -> None:
        """Set an arm that hangs from the chest: swung forward, spread sideways, twisted inward, elbow bent (T,) [rad].

        `pronation` and `hand` are those of `pose_arm`.
        """
        sign = SIDE_SIGN[side]
        rest = limb_ik.hinge_frame(self.skeleton, f"{side}humerus")
        turn = axis_rotation(1, -swing) @ axis_rotation(0, sign * spread) @ axis_rotation(2, -sign * twist)
        self.pose_arm(side, self.chest @ turn @ _HANGING_ARM_FRAME @ rest.T, elbow, pronation, hand)

    def pose_reaching_arm(
        self, side: str, wrist_m: Floats, elbow_direction: Floats, pronation: Floats, hand: WristAngles
    ) -> None:
        """Set an arm so that its wrist is at `wrist_m` (T, 3) in the world, drawn in where that is out of reach.

        The elbow points in `elbow_direction` (T, 3); `pronation` and `hand` are those of `pose_arm`.
        """
        self.pose_arm(side, *self._two_bone_arm(side, wrist_m, elbow_direction), pronation, hand)

    def pronation_facing(self, side: str, wrist_m: Floats, elbow_direction: Floats, palm: Floats) -> Floats:
        """Pronation (T,) at which the palm of a reaching arm faces the world direction `palm` (T, 3) [rad].

        The arm is that of `pose_reaching_arm`. The result is softly limited to the range of a forearm.
        """
        upper, elbow = self._two_bone_arm(side, wrist_m, elbow_direction)
        rest = limb_ik.hinge_frame(self.skeleton, f"{side}humerus")
        facing = rotate_vectors(np.swapaxes(upper @ rest @ axis_rotation(0, elbow), -1, -2), palm)
        down = -rest[2]
        angle = np.unwrap(np.arctan2(facing[:, 0], facing[:, 2]) - np.arctan2(down[0], down[2]))
        angle = -SIDE_SIGN[side] * (angle - 2.0 * np.pi * np.round(np.median(angle) / (2.0 * np.pi)))
        out: Floats = -0.4 + 1.3 * np.tanh((angle + 0.4) / 1.3)
        return out

    def _two_bone_arm(self, side: str, wrist_m: Floats, elbow_direction: Floats) -> tuple[Floats, Floats]:
        """World rotation (T, 3, 3) of the upper arm and flexion (T,) of the elbow for a wrist at `wrist_m`."""
        first = self.length_m(f"{side}humerus")
        second = self.length_m(f"{side}radius") + self.length_m(f"{side}wrist")
        shoulder = self.shoulder_m(side)
        line = wrist_m - shoulder
        distance = np.sqrt(np.sum(line**2, axis=-1, keepdims=True))
        longest, shortest = 0.985 * (first + second), 0.32 * (first + second)
        reach = smooth_maximum(smooth_minimum(distance, np.array(longest), 0.02), np.array(shortest), 0.02)
        wrist = shoulder + line * (reach / distance)
        joint = limb_ik.middle_joint(shoulder, wrist, elbow_direction, first, second)
        rest = limb_ik.hinge_frame(self.skeleton, f"{side}humerus")
        return limb_ik.two_bone_angles(
            normalize(joint - shoulder), normalize(wrist - joint), normalize(np.cross(elbow_direction, line)), rest
        )
