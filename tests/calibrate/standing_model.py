"""A simulated performer of the eight poses: tracker frames, and the truth behind them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from harness.body import DEFAULT_MOUNTS, Kinematics, Mount, build_body, locate_mount
from harness.calibrate.poses import POSES, pose_configuration
from harness.calibrate.skeleton_prior import SkeletonPrior, fit_skeleton_prior
from harness.calibrate.tpose_calibration import LEVEL_FROM_TRACKER
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.humanoid24 import standard_skeleton
from harness.core.seeds import generator
from harness.core.skeleton import Skeleton
from harness.mocap.synthetic import sample_skeletons
from harness.stream import TrackerFrame

SIX = ("left_wrist", "right_wrist", "left_ankle", "right_ankle", "torso", "head")
FIVE = ("left_hand", "right_hand", "left_ankle", "right_ankle", "pelvis")
FRAMES, SECONDS = 12, 2.4


@cache
def space() -> SkeletonPrior:
    """Prior of the bones of a hundred people, none of whom is a test performer."""
    return fit_skeleton_prior(sample_skeletons(100, seed=0), source="others")


def straightened(skeleton: Skeleton) -> Skeleton:
    """A skeleton of these bone lengths with the standard skeleton's directions."""
    standard = standard_skeleton()
    return skeleton.with_bones(standard.bone_m * (skeleton.length_m / standard.length_m)[:, None])


@cache
def somebody(number: int, own_directions: bool = True) -> Skeleton:
    own = sample_skeletons(120, seed=0)[100 + number]
    return own if own_directions else straightened(own)


@dataclass(frozen=True, eq=False)
class Model:
    """A performer who wears trackers; body, mounts, room and pose errors are drawn from the seed."""

    skeleton: Skeleton
    stations: tuple[str, ...] = SIX
    miss_rad: float = 0.0
    noise_m: float = 0.0
    """Noise of each frame on each axis, standard deviation."""
    noise_rad: float = 0.0
    beside_m: float = 0.0
    yaw_rad: float = 0.7
    shift_m: tuple[float, float, float] = (1.5, -0.7, 0.4)
    straps: bool = True
    """Whether straps have random orientations or the nominal ones."""
    seed: int = 1

    @property
    def mounts(self) -> list[Mount]:
        return [DEFAULT_MOUNTS[station] for station in self.stations]

    @property
    def truth(self) -> Calibration:
        """The world's origin is where the first pose's root is in x and y, and the floor."""
        rng = generator(self.seed, "straps")
        placed = [locate_mount(self.skeleton, mount) for mount in self.mounts]
        turn = rng.normal(size=(len(placed), 4))
        turn /= np.linalg.norm(turn, axis=1, keepdims=True)
        beside_m = self.beside_m * rng.normal(size=(len(placed), 3))
        world_from_tracker = rotations.multiply(LEVEL_FROM_TRACKER, rotations.about_z(self.yaw_rad))
        return Calibration(
            kind="exact",
            stations=self.stations,
            bones=tuple(mount.bone for mount in self.mounts),
            mount_m=np.array([at_m for at_m, _ in placed]) + beside_m,
            bone_from_station=rotations.multiply(
                np.array([turned for _, turned in placed]), turn if self.straps else rotations.IDENTITY
            ),
            world_from_tracker=world_from_tracker,
            tracker_origin_m=np.array(self.shift_m),
        )

    def held(self) -> list[list[TrackerFrame]]:
        """Frames of each pose."""
        return [self._frames(self._missed(number), number) for number in range(len(POSES))]

    def _missed(self, number: int) -> Floats:
        """The pose as it is held: missed, and but for the first stepped aside."""
        rng, kinematics = generator(self.seed, "missed", number), Kinematics(build_body(self.skeleton))
        step = self.miss_rad * rng.normal(size=54)
        step[:3] = [*rng.normal(0.0, 0.05, 2), 0.0]
        step[5] = rng.normal(0.0, 0.1)
        if number == 0:
            step[[0, 1, 5]] = 0.0
        return kinematics.integrate(pose_configuration(POSES[number], self.skeleton), step)

    def _frames(self, qpos: Floats, number: int) -> list[TrackerFrame]:
        truth, kinematics = self.truth, Kinematics(build_body(self.skeleton))
        kinematics.set(qpos)
        bones = [self.skeleton.index(bone) for bone in truth.bones]
        place_m, turn = kinematics.station_poses(bones, truth.mount_m, truth.bone_from_station)
        rng, back = generator(self.seed, "noise", number), rotations.inverse(truth.world_from_tracker)
        frames = []
        for at_s in np.linspace(0.0, SECONDS, FRAMES).tolist():
            noise_m, noise = (
                self.noise_m * rng.normal(size=place_m.shape),
                self.noise_rad * rng.normal(size=place_m.shape),
            )
            told = rotations.multiply(rotations.exp(noise), turn)
            frames.append(
                TrackerFrame(
                    received_s=at_s,
                    measured_s=np.full(len(bones), at_s),
                    position_m=rotations.rotate(back, place_m + noise_m - truth.tracker_origin_m),
                    tracker_from_station=rotations.multiply(back, told),
                    position_valid=np.ones(len(bones), dtype=bool),
                    orientation_valid=np.ones(len(bones), dtype=bool),
                    quality=np.ones(len(bones)),
                    suspect=np.zeros(len(bones), dtype=bool),
                )
            )
        return frames


def turned(held: Sequence[Sequence[TrackerFrame]], station: int, turn: Floats) -> list[list[TrackerFrame]]:
    """Frames with one station's orientations rotated in the tracker's axes, as a boresight does."""
    out = []
    for frames in held:
        rows = []
        for frame in frames:
            quaternions = np.array(frame.tracker_from_station)
            quaternions[station] = rotations.multiply(turn, quaternions[station])
            rows.append(replace(frame, tracker_from_station=quaternions))
        out.append(rows)
    return out


def reordered(held: Sequence[Sequence[TrackerFrame]], rows: list[int]) -> list[list[TrackerFrame]]:
    """Frames with the stations in another order."""
    return [
        [
            replace(
                frame,
                position_m=frame.position_m[rows],
                tracker_from_station=frame.tracker_from_station[rows],
            )
            for frame in frames
        ]
        for frames in held
    ]
