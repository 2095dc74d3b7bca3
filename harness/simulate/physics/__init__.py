"""The physics of the tracker: constellation, sound, sight, inertia, and the filter that fuses them."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.simulate.physics.constellation import (
        Constellation,
        ConstellationSettings,
        constellation_path,
        load_constellation,
    )
    from harness.simulate.physics.coverage import (
        EmitterCoverage,
        emitter_coverage,
        grid_m,
        plan_axes_m,
        station_coverage,
    )
    from harness.simulate.physics.emitters import read_mcf
    from harness.simulate.physics.filter_state import RangingModel, range_variance
    from harness.simulate.physics.free_motion import FACING_UP, FreeMotionSource, random_motion
    from harness.simulate.physics.inertial import Inertial
    from harness.simulate.physics.line_of_sight import LineOfSight
    from harness.simulate.physics.motion import TrackerMotion
    from harness.simulate.physics.physical_tracker import PhysicalTracker, RangeSource, lead_in_s
    from harness.simulate.physics.ranging import Ranges
    from harness.simulate.physics.room import Box, PlacedRoom, fit_room
    from harness.simulate.physics.schedule import Schedule
    from harness.simulate.physics.settings import Physics
    from harness.simulate.physics.sound import Sound, speed_of_sound_m_s
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "FACING_UP",
    "Box",
    "Constellation",
    "ConstellationSettings",
    "EmitterCoverage",
    "FreeMotionSource",
    "Inertial",
    "LineOfSight",
    "PhysicalTracker",
    "Physics",
    "PlacedRoom",
    "RangeSource",
    "Ranges",
    "RangingModel",
    "Schedule",
    "Sound",
    "TrackerMotion",
    "constellation_path",
    "emitter_coverage",
    "fit_room",
    "grid_m",
    "lead_in_s",
    "load_constellation",
    "plan_axes_m",
    "random_motion",
    "range_variance",
    "read_mcf",
    "speed_of_sound_m_s",
    "station_coverage",
]
