"""True motion of trackers that a performer wears."""

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.simulate.physics.motion import TrackerMotion, continued
from harness.simulate.physics.worn import Worn
from harness.simulate.skin import tissue_force_m_s2
from harness.simulate.trajectory import Trajectory


class BodyMotionSource:
    """A `TrackerMotionSource`: the stations of a calibration on a trajectory, with what `worn` does to them."""

    def __init__(self, trajectory: Trajectory, calibration: Calibration, worn: Worn) -> None:
        self.stations = calibration.stations
        self._trajectory, self._calibration, self._worn = trajectory, calibration, worn
        self._tracker_from_world = rotations.inverse(calibration.world_from_tracker)
        self._last_turn: Floats | None = None

    def advance(self, time_s: Floats) -> TrackerMotion:
        """Motion at the ticks (T+1,) of the next block [s]; BadInput outside the trajectory."""
        true = self._trajectory.station_motion(
            self._calibration, np.repeat(time_s[:, None], len(self.stations), axis=1)
        )
        tracker_from_world = self._tracker_from_world
        turn = rotations.multiply(tracker_from_world, true.world_from_station)
        motion = TrackerMotion(
            time_s=time_s,
            position_m=rotations.rotate(tracker_from_world, true.position_m - self._calibration.tracker_origin_m),
            tracker_from_station=continued(turn, self._last_turn),
            velocity_m_s=rotations.rotate(tracker_from_world, true.velocity_m_s),
            turn_rad_s=rotations.rotate(tracker_from_world, true.turn_rad_s),
        )
        self._last_turn = motion.tracker_from_station[-1].copy()
        self._worn.apply(motion, tissue_force_m_s2(true, self._calibration) if self._worn.on_tissue else None)
        return motion

    def qpos(self, time_s: Floats) -> Floats:
        """(F, 55) configurations at F times [s]."""
        return self._trajectory.qpos(time_s)
