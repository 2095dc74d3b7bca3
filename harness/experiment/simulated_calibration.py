"""What methods are told of trackers, room and body before a take, found as on a real day: from a stream in which the
performer stands model, in the same session of the tracker; and how far from the truth that is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.body.humanoid import Body, build_body, tpose
from harness.body.mounts import Mount
from harness.calibrate.guided_calibration import PoseGuide
from harness.calibrate.pose_calibration import calibrate_poses
from harness.calibrate.pose_classifier import PoseClassifier
from harness.calibrate.pose_collector import PoseCollector
from harness.calibrate.poses import POSES, configuration
from harness.calibrate.skeleton_prior import SkeletonPrior
from harness.calibrate.tpose_calibration import calibrate_tpose
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.core.skeleton import Skeleton
from harness.simulate.held_poses import hold_poses
from harness.simulate.noise import Noise
from harness.simulate.simulation import Simulation, TrackerConfig, exact_calibration, simulate_tracker
from harness.stream.frame import TrackerFrame


@dataclass(frozen=True, eq=False)
class TrackerSession:
    """Everything that is true of a session, from the trackers being put on to their being taken off."""

    name: str
    """Of the take that it is for: errors that last for a session are those of this take."""
    seed: int
    body: Body
    """The performer's."""
    nominal: tuple[Mount, ...]
    """Where trackers are said to be worn."""
    true_mounts: tuple[Mount, ...]
    """Where they really are."""
    tracker: TrackerConfig
    noise: Noise
    """What goes wrong; what happens at one moment of the take does not happen while calibrating."""

    @property
    def true_calibration(self) -> Calibration:
        """The truth."""
        return exact_calibration(self.body, self.true_mounts, self.tracker)

    @property
    def calibration_noise(self) -> Noise:
        """What goes wrong while calibrating too."""
        return replace(self.noise, mount_slip=(), position_offset=(), orientation_offset=(), lost=())

    def make_pose_take(self, configurations: Sequence[Floats], *, miss_rad: float, hold_s: float) -> BodyMotion:
        """The performer holding configurations (55,), at the world's origin and facing x to begin with.

        How the n-th is missed does not depend on those after it.
        """
        rng = generator(self.seed, "standing model", self.name)
        take = hold_poses(self.body, configurations, miss_rad=miss_rad, rng=rng, hold_s=hold_s)
        return replace(take, name=f"{self.name} calibration")

    def observe(self, take: BodyMotion) -> Simulation:
        """A take for calibration as the tracker sees it."""
        return simulate_tracker(
            self.body, take, self.true_mounts, self.tracker, self.calibration_noise, seed=self.seed, session=self.name
        )

    def observe_poses(
        self, configurations: Sequence[Floats], *, miss_rad: float, hold_s: float
    ) -> tuple[TrackerFrame, ...]:
        """The stream of `model`."""
        return self.observe(self.make_pose_take(configurations, miss_rad=miss_rad, hold_s=hold_s)).frames


@dataclass(frozen=True, eq=False)
class PerformerCalibration:
    """What a method goes by."""

    calibration: Calibration
    body: Body
    """With the bone lengths that are known or were found."""
    errors: Mapping[str, float]
    """How far that is from the truth, see `measure_calibration_errors`; empty where it is the truth."""
    notes: tuple[str, ...] = ()


def use_exact_calibration(session: TrackerSession) -> PerformerCalibration:
    """Nothing had to be found."""
    return PerformerCalibration(session.true_calibration, session.body, {})


def simulate_tpose_calibration(session: TrackerSession, *, miss_rad: float, hold_s: float) -> PerformerCalibration:
    """Mounts and room from a T-pose; bone lengths are known from elsewhere. NotStanding says what was wrong with it."""
    pose = tpose(session.body.skeleton)
    frames = session.observe_poses([pose], miss_rad=miss_rad, hold_s=hold_s)
    found = calibrate_tpose(frames, session.body, session.nominal)
    errors = measure_calibration_errors(found.calibration, session.body.skeleton, session)
    return PerformerCalibration(
        found.calibration, session.body, errors, (_error_note("T-pose, bone lengths known", errors),)
    )


def simulate_poses_calibration(
    session: TrackerSession, space: SkeletonPrior, *, miss_rad: float, hold_s: float
) -> PerformerCalibration:
    """Bone lengths, mounts and room from eight poses and from what other people's bones are like: of the performer,
    nothing is known but the stream. NotStanding when the poses cannot be found in it, or not be calibrated from."""
    poses = [configuration(pose, session.body.skeleton) for pose in POSES]
    frames = session.observe_poses(poses, miss_rad=miss_rad, hold_s=hold_s)
    nobody = build_body()
    shown = [configuration(pose, nobody.skeleton) for pose in POSES]
    stations = [mount.station for mount in session.nominal]
    collector = PoseCollector(stations, len(POSES), PoseClassifier(nobody, session.nominal, shown))
    PoseGuide(collector, POSES).run(frames, say=lambda text: None)
    found = calibrate_poses(collector.holds, space, session.nominal)
    errors = measure_calibration_errors(found.calibration, found.skeleton, session)
    notes = (_error_note(f"eight poses, other bones learnt from {space.source}", errors),)
    return PerformerCalibration(found.calibration, build_body(found.skeleton), errors, notes)


def measure_calibration_errors(found: Calibration, skeleton: Skeleton, session: TrackerSession) -> dict[str, float]:
    """Of mounts, root mean square over stations [mm] and [deg]; of bone lengths, root mean square [mm]; of the room's
    frame, its turn about the vertical [deg] and its origin [mm]."""
    true = session.true_calibration
    beside_m = np.linalg.norm(found.mount_m - true.mount_m, axis=1)
    turned_rad = rotations.angle_between_rad(found.bone_from_station, true.bone_from_station)
    room = rotations.multiply(found.world_from_tracker, rotations.inverse(true.world_from_tracker))
    return {
        "mount_mm": 1e3 * _rms(beside_m),
        "mount_deg": float(np.rad2deg(_rms(turned_rad))),
        "length_mm": 1e3 * _rms(skeleton.length_m - session.body.skeleton.length_m),
        "room_heading_deg": float(np.rad2deg(abs(rotations.yaw_rad(room)))),
        "room_origin_mm": 1e3 * float(np.linalg.norm(found.tracker_origin_m - true.tracker_origin_m)),
    }


def _error_note(how: str, errors: Mapping[str, float]) -> str:
    return (
        f"calibrated by {how}: mounts {errors['mount_mm']:.0f} mm and {errors['mount_deg']:.1f} deg off, bone lengths "
        f"{errors['length_mm']:.0f} mm (root mean square), room {errors['room_heading_deg']:.1f} deg about the vertical"
    )


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
