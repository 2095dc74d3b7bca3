"""The physics of the tracker: constellation, sound, sight, inertia, and the filter that fuses them."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.simulate.physics.constellation import Constellation as Constellation
    from harness.simulate.physics.constellation import ConstellationSettings as ConstellationSettings
    from harness.simulate.physics.constellation import constellation_path as constellation_path
    from harness.simulate.physics.constellation import load_constellation as load_constellation
    from harness.simulate.physics.coverage import EmitterCoverage as EmitterCoverage
    from harness.simulate.physics.coverage import emitter_coverage as emitter_coverage
    from harness.simulate.physics.coverage import grid_m as grid_m
    from harness.simulate.physics.coverage import plan_axes_m as plan_axes_m
    from harness.simulate.physics.coverage import station_coverage as station_coverage
    from harness.simulate.physics.emitters import read_mcf as read_mcf
    from harness.simulate.physics.filter_state import RangingModel as RangingModel
    from harness.simulate.physics.filter_state import range_variance as range_variance
    from harness.simulate.physics.free_motion import FACING_UP as FACING_UP
    from harness.simulate.physics.free_motion import FreeMotionSource as FreeMotionSource
    from harness.simulate.physics.free_motion import random_motion as random_motion
    from harness.simulate.physics.inertial import Inertial as Inertial
    from harness.simulate.physics.line_of_sight import LineOfSight as LineOfSight
    from harness.simulate.physics.motion import TrackerMotion as TrackerMotion
    from harness.simulate.physics.physical_tracker import PhysicalTracker as PhysicalTracker
    from harness.simulate.physics.physical_tracker import RangeSource as RangeSource
    from harness.simulate.physics.physical_tracker import lead_in_s as lead_in_s
    from harness.simulate.physics.ranging import Ranges as Ranges
    from harness.simulate.physics.room import Box as Box
    from harness.simulate.physics.room import PlacedRoom as PlacedRoom
    from harness.simulate.physics.room import fit_room as fit_room
    from harness.simulate.physics.schedule import Schedule as Schedule
    from harness.simulate.physics.settings import Physics as Physics
    from harness.simulate.physics.sound import Sound as Sound
    from harness.simulate.physics.sound import speed_of_sound_m_s as speed_of_sound_m_s
else:
    __getattr__, __dir__ = lazy_names(__name__)
