"""Simulated calibration of trackers, room and body, and its errors.

As on a real day the calibration is estimated from a stream in which the performer holds poses, in the same session of
the tracker as the take.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.body import Body, Mount, build_body, tpose
from harness.calibrate import (
    POSES,
    PoseClassifier,
    PoseCollector,
    PoseGuide,
    SensorMaps,
    SkeletonPrior,
    calibrate_kim2012,
    calibrate_liu2011,
    calibrate_poses,
    calibrate_tpose,
    pose_configuration,
)
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.core.skeleton import Skeleton
from harness.simulate import Noise, Simulation, TrackerConfig, exact_calibration, hold_poses, simulate_tracker
from harness.stream import TrackerFrame


@dataclass(frozen=True, eq=False)
class TrackerSession:
    """The truth about one session, from putting the trackers on to taking them off."""

    name: str
    """Name of the take of the session, which keys the errors that last for a session."""
    seed: int
    body: Body
    """The performer's true body."""
    nominal: tuple[Mount, ...]
    """Nominal mounts: where the trackers should sit."""
    true_mounts: tuple[Mount, ...]
    """True mounts: where the trackers really sit."""
    tracker: TrackerConfig
    noise: Noise
    """Errors of the tracker during the take."""

    @property
    def true_calibration(self) -> Calibration:
        """The exact calibration."""
        return exact_calibration(self.body, self.true_mounts, self.tracker)

    @property
    def calibration_noise(self) -> Noise:
        """Errors of the tracker during calibration: those of the take without events at single moments."""
        return replace(self.noise, mount_slip=(), position_offset=(), orientation_offset=(), lost=())

    def make_pose_take(self, configurations: Sequence[Floats], *, miss_rad: float, hold_s: float) -> BodyMotion:
        """A take in which the performer holds configurations (55,), at the world's origin and facing x at first.

        Each pose is missed by random angles of standard deviation `miss_rad`. They do not depend on later poses.
        """
        rng = generator(self.seed, "standing model", self.name)
        take = hold_poses(self.body, configurations, miss_rad=miss_rad, rng=rng, hold_s=hold_s)
        return replace(take, name=f"{self.name} calibration")

    def observe(self, take: BodyMotion) -> Simulation:
        """Simulate the stream of a calibration take."""
        return simulate_tracker(
            self.body, take, self.true_mounts, self.tracker, self.calibration_noise, seed=self.seed, session=self.name
        )

    def observe_poses(
        self, configurations: Sequence[Floats], *, miss_rad: float, hold_s: float
    ) -> tuple[TrackerFrame, ...]:
        """Simulate the stream of held configurations, see `make_pose_take`."""
        return self.observe(self.make_pose_take(configurations, miss_rad=miss_rad, hold_s=hold_s)).frames


@dataclass(frozen=True, eq=False)
class PerformerCalibration:
    """The calibration that a method receives."""

    calibration: Calibration
    body: Body
    """Body with the known or estimated bone lengths."""
    errors: Mapping[str, float]
    """Errors against the truth, see `measure_calibration_errors`; empty for the exact calibration."""
    notes: tuple[str, ...] = ()
    maps: SensorMaps | None = None
    """Maps of the readings that the method receives; None leaves them as the tracker reports them."""

    def map_stream(self, simulation: Simulation) -> Simulation:
        """The simulation with the frames that the method receives."""
        if self.maps is None:
            return simulation
        return replace(simulation, frames=tuple(self.maps.apply(frame) for frame in simulation.frames))


def use_exact_calibration(session: TrackerSession) -> PerformerCalibration:
    """The exact calibration on the true body."""
    return PerformerCalibration(session.true_calibration, session.body, {})


def simulate_tpose_calibration(session: TrackerSession, *, miss_rad: float, hold_s: float) -> PerformerCalibration:
    """Estimate mounts and room from a simulated T-pose; bone lengths are known. UnusableHold for a bad pose."""
    pose = tpose(session.body.skeleton)
    frames = session.observe_poses([pose], miss_rad=miss_rad, hold_s=hold_s)
    found = calibrate_tpose(frames, session.body, session.nominal)
    return _with_errors(session, found.calibration, session.body, "T-pose, bone lengths known")


def simulate_poses_calibration(
    session: TrackerSession, prior: SkeletonPrior, *, miss_rad: float, hold_s: float
) -> PerformerCalibration:
    """Estimate bone lengths, mounts and room from eight simulated poses and a prior on bone lengths of other people.

    Only the stream is known of the performer. UnusableHold when the poses cannot be found in it, or are unusable.
    """
    held = _observe_eight_poses(session, miss_rad, hold_s)
    found = calibrate_poses(held, prior, session.nominal)
    procedure = f"eight poses, other bones learnt from {prior.source}"
    return _with_errors(session, found.calibration, build_body(found.skeleton), procedure)


def simulate_liu2011_calibration(
    session: TrackerSession, prior: SkeletonPrior, *, miss_rad: float, hold_s: float
) -> PerformerCalibration:
    """As `simulate_poses_calibration`, by eq. 1 of Liu et al. 2011 as printed; the same stream.

    UnusableHold also when a bone of the minimum has no length, since no body can be built from it.
    """
    found = calibrate_liu2011(_observe_eight_poses(session, miss_rad, hold_s), prior, session.nominal)
    procedure = f"Liu's eq. 1 as printed, other bones learnt from {prior.source}"
    return _with_errors(session, found.calibration, build_body(found.skeleton), procedure)


def simulate_kim2012_calibration(session: TrackerSession, *, miss_rad: float, hold_s: float) -> PerformerCalibration:
    """Maps by eq. 1 of Kim et al. 2012 as printed, from the T-pose of `simulate_tpose_calibration`.

    Methods receive mapped readings and the nominal mounts. The errors name the room's heading alone, because the maps
    have no mounts and no common origin.
    """
    frames = session.observe_poses([tpose(session.body.skeleton)], miss_rad=miss_rad, hold_s=hold_s)
    found = calibrate_kim2012(frames, session.body, session.nominal)
    heading_deg = _heading_error_deg(found.maps.world_from_tracker, session)
    note = f"calibrated by Kim's eq. 1 as printed: no mounts, room {heading_deg:.1f} deg about the vertical"
    return PerformerCalibration(
        found.calibration, session.body, {"room_heading_deg": heading_deg}, (note,), maps=found.maps
    )


def _observe_eight_poses(session: TrackerSession, miss_rad: float, hold_s: float) -> list[list[TrackerFrame]]:
    """Frames of the eight holds, as the collector finds them in the simulated stream."""
    poses = [pose_configuration(pose, session.body.skeleton) for pose in POSES]
    frames = session.observe_poses(poses, miss_rad=miss_rad, hold_s=hold_s)
    standard = build_body()
    shown = [pose_configuration(pose, standard.skeleton) for pose in POSES]
    stations = [mount.station for mount in session.nominal]
    collector = PoseCollector(stations, len(POSES), PoseClassifier(standard, session.nominal, shown))
    PoseGuide(collector, POSES).run(frames, say=lambda text: None)
    return collector.holds


def measure_calibration_errors(found: Calibration, skeleton: Skeleton, session: TrackerSession) -> dict[str, float]:
    """Errors of a calibration: mounts (RMS over stations) [mm], [deg]; bone lengths (RMS) [mm]; room heading [deg] and
    origin [mm]."""
    true = session.true_calibration
    beside_m = np.linalg.norm(found.mount_m - true.mount_m, axis=1)
    turned_rad = rotations.angle_between_rad(found.bone_from_station, true.bone_from_station)
    return {
        "mount_mm": 1e3 * _rms(beside_m),
        "mount_deg": float(np.rad2deg(_rms(turned_rad))),
        "length_mm": 1e3 * _rms(skeleton.length_m - session.body.skeleton.length_m),
        "room_heading_deg": _heading_error_deg(found.world_from_tracker, session),
        "room_origin_mm": 1e3 * float(np.linalg.norm(found.tracker_origin_m - true.tracker_origin_m)),
    }


def _heading_error_deg(world_from_tracker: Floats, session: TrackerSession) -> float:
    room = rotations.multiply(world_from_tracker, rotations.inverse(session.true_calibration.world_from_tracker))
    return float(np.rad2deg(abs(rotations.yaw_rad(room))))


def _with_errors(session: TrackerSession, found: Calibration, body: Body, procedure: str) -> PerformerCalibration:
    errors = measure_calibration_errors(found, body.skeleton, session)
    note = (
        f"calibrated by {procedure}: mounts {errors['mount_mm']:.0f} mm and {errors['mount_deg']:.1f} deg off, "
        f"bone lengths {errors['length_mm']:.0f} mm (root mean square), "
        f"room {errors['room_heading_deg']:.1f} deg about the vertical"
    )
    return PerformerCalibration(found, body, errors, (note,))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
