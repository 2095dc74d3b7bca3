"""True motion of trackers that a performer wears."""

import numpy as np

from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.simulate.physics.motion import TrackerMotion
from harness.simulate.physics.station_kinematics import station_chain, station_states
from harness.simulate.physics.worn import Worn
from harness.simulate.skin import tissue_force_m_s2
from harness.simulate.trajectory import Trajectory


class BodyMotionSource:
    """A `TrackerMotionSource`: the stations of a calibration on a trajectory, with what `worn` does to them."""

    def __init__(self, trajectory: Trajectory, calibration: Calibration, worn: Worn) -> None:
        self.stations = calibration.stations
        self._trajectory, self._calibration, self._worn = trajectory, calibration, worn
        self._chain = station_chain(trajectory.body.skeleton, calibration)
        self._pieces: Floats = np.ascontiguousarray(trajectory.spline.c)
        self._knots_s: Floats = np.ascontiguousarray(trajectory.spline.x)

    def advance(self, time_s: Floats) -> TrackerMotion:
        """Motion at the ticks (T+1,) of the next block [s]; BadInput outside the trajectory."""
        self._trajectory.require_inside(time_s)
        true = station_states(self._chain, self._pieces, self._knots_s, time_s)
        motion = TrackerMotion(time_s, true.position_m, true.tracker_from_station, true.velocity_m_s, true.turn_rad_s)
        force_m_s2 = None
        if self._worn.on_tissue:
            force_m_s2 = tissue_force_m_s2(
                true.tracker_from_station, true.acceleration_m_s2, self._calibration, self._chain.tracker_from_world
            )
        self._worn.apply(motion, force_m_s2)
        return motion

    def qpos(self, time_s: Floats) -> Floats:
        """(F, 55) configurations at F times [s]."""
        return self._trajectory.qpos(time_s)
