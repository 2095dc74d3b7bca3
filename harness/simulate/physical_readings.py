"""Physical readings of the stations that a performer wears: the parts of a physical tracker put together.

Prediction and enhancement of the device change them by the settings of each station (docs/is900.md 4.2).
"""

from collections.abc import Sequence

import numpy as np

from harness.body import Mount, pose_from_qpos
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.simulate.components.soft_tissue import skin_below
from harness.simulate.noise import Noise
from harness.simulate.physics.constellation import Constellation, check_reach, load_constellation, middle_of_path_m
from harness.simulate.physics.filter_settings import Fusion
from harness.simulate.physics.line_of_sight import LineOfSight
from harness.simulate.physics.physical_tracker import PhysicalTracker, lead_in_s
from harness.simulate.physics.room import PlacedRoom, Room, check_room, fit_room, place_room
from harness.simulate.physics.settings import Physics
from harness.simulate.physics.station_displacement import BodyMotionSource, StationDisplacement
from harness.simulate.readings import FilterReadings, SimulatedReadings
from harness.simulate.trajectory import Trajectory
from harness.stream.polhemus.codec import FilterSamples

_LEAD_OUT_S = 0.5
"""Motion after the take: the last slot may end later than it [s]."""
_CHECKED_HZ = 10.0
"""Rate at which the path is compared with the room and the constellation [Hz]."""


def simulate_physical_readings(
    trajectory: Trajectory,
    mounts: Sequence[Mount],
    calibration: Calibration,
    noise: Noise,
    physics: Physics,
    time_s: Floats,
    *,
    seed: int,
    take: str,
    session: str = "",
    ends_s: float | None = None,
) -> tuple[FilterReadings, Constellation, Room]:
    """Readings at the times (E, S) of a trajectory, the constellation that the device knows, and the room.

    `calibration` is the exact one. `ends_s` is the last sampling time of the take, when a way back follows it [s].
    `take` and `session` key the random draws. BadInput when the room is too small for the motion or the emitters, and
    when no emitter is within reach.
    """
    constellation, placed = place_constellation(trajectory, calibration, physics)
    whole = trajectory.with_lead_in(lead_in_s(physics))
    if whole.ends_s == trajectory.duration_s:
        whole = whole.with_lead_out(_LEAD_OUT_S)
    displacement = StationDisplacement(
        noise,
        calibration.stations,
        skin_below(trajectory.body.skeleton, mounts, calibration),
        tick_hz=physics.inertial.rate_hz,
        ends_s=float(time_s.max()) if ends_s is None else ends_s,
        seed=seed,
        take=take,
        session=session,
    )
    tracker = PhysicalTracker(
        BodyMotionSource(whole, calibration, displacement),
        physics,
        constellation,
        placed,
        LineOfSight(trajectory.body, placed) if physics.room.shadow else None,
        seed=seed,
        take=take,
        session=session,
    )
    return tracker.measure_take(time_s), constellation, placed.room


def place_constellation(
    trajectory: Trajectory, calibration: Calibration, physics: Physics
) -> tuple[Constellation, PlacedRoom]:
    """The constellation in the tracker's frame, and the room around it, which holds the take's path.

    Both lie above the middle of the root's path, unless `constellation.centre_m` says otherwise. BadInput if a station
    or the end of a bone leaves the room, and if no emitter is within reach.
    """
    settings, origin_m = physics.constellation, calibration.tracker_origin_m
    frames = max(round(trajectory.duration_s * _CHECKED_HZ), 1) + 1
    root_m = trajectory.qpos(np.linspace(0.0, trajectory.duration_s, frames))[:, :3]
    centre_m = middle_of_path_m(root_m) if settings.centre_m is None else np.array(settings.centre_m)
    half_x, half_y = np.max(np.abs(root_m[:, :2] - centre_m), axis=0).tolist()
    constellation = load_constellation(settings, (half_x, half_y))
    time_s = np.arange(0.0, trajectory.duration_s, 1.0 / _CHECKED_HZ)
    stations = trajectory.station_motion(calibration, np.repeat(time_s[:, None], len(calibration.stations), axis=1))
    skeleton = trajectory.body.skeleton
    end_m = pose_from_qpos(skeleton, trajectory.qpos(time_s)).end_m
    everything_m = np.concatenate([stations.position_m, end_m], axis=1)[..., :2].reshape(-1, 2)
    room = fit_room(physics.room, constellation, float(origin_m[2]), everything_m - centre_m)
    for row, station in enumerate(calibration.stations):
        check_room(room, centre_m, f"station {station}", stations.position_m[:, row])
    for row, bone in enumerate(skeleton.names):
        check_room(room, centre_m, f"bone {bone}", end_m[:, row])
    constellation, placed = place_room(room, constellation, centre_m, calibration)
    tracker_from_world = rotations.inverse(calibration.world_from_tracker)
    places_m = rotations.rotate(tracker_from_world, stations.position_m - origin_m)
    check_reach(constellation, places_m.reshape(-1, 3))
    return constellation, placed


def filter_samples(readings: SimulatedReadings, fusion: Fusion) -> FilterSamples:
    """What prediction and enhancement need, with the faults of physical readings (docs/is900.md 4.2).

    A fault moves the poses of every enhancement mode alike. A station that is lost does not move. ValueError for
    readings of no physical tracker.
    """
    found = readings.filter
    if found is None:
        raise ValueError("statistical readings have no filter")
    turned = rotations.multiply(readings.turn, rotations.inverse(found.tracker_from_station))
    moves = ~readings.affected.get("lost", np.zeros(readings.time_s.shape, dtype=bool))[..., None]
    return FilterSamples(
        velocity_m_s=np.where(moves, found.velocity_m_s, 0.0),
        turn_rad_s=np.where(moves, found.turn_rad_s, 0.0),
        enhanced_position_m=found.enhanced_position_m + (readings.position_m - found.position_m),
        enhanced_tracker_from_station=rotations.multiply(turned, found.enhanced_tracker_from_station),
        ranges_received=found.ranges_received,
        ranges_rejected=found.ranges_rejected,
        emitters=readings.emitters,
        prediction_ms=np.array([fusion.prediction_ms.get(station, 0) for station in readings.stations]),
        enhancement=np.array([fusion.enhancement.get(station, 0) for station in readings.stations]),
    )


def apply_device_settings(readings: SimulatedReadings, fusion: Fusion) -> None:
    """Change the readings to what the stations report with the scenario's prediction and enhancement."""
    if any((*fusion.prediction_ms.values(), *fusion.enhancement.values())):
        samples = filter_samples(readings, fusion)
        readings.position_m, readings.turn = samples.report_poses(
            readings.position_m, readings.turn, samples.prediction_ms, samples.enhancement
        )
