"""Records of a station, written from the filter's state between two ticks, in every mode of enhancement (`MF`).

Perceptual enhancement spreads the filter's corrections over time. A correction moves the filter's estimate. The output
keeps its place, because the opposite of the correction is added to an offset, which then decays. Mode 1 lets it decay
all the time, and mode 2 only while the station moves (docs/is900.md 4.2 and 13.3). The rates are choices.
"""

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.core.compiled_rotations import Vector, quaternion_from_vector, quaternion_product, rotate, rotation_vector
from harness.simulate.physics.filter_state import FilterModel, FilterState, Outputs
from harness.simulate.physics.schedule import TICKS_PER_SLOT
from harness.simulate.physics.strapdown import attitude

MODES = 3
"""Mode 0 has no offset."""
_DECAY_S = 0.25
_DECAY_M = 0.1
_DECAY_RAD = 0.5
_SLOWEST_S = 0.05


@compiled
def write_record(
    model: FilterModel,
    state: FilterState,
    s: int,
    k: int,
    turn: Vector,
    acceleration: Vector,
    outputs: Outputs,
    record: int,
) -> None:
    """Write a record of station s, from the slot's tick k and the motion of the interval before it."""
    now, lever = state.motion[s, k], model.lever_m
    since = outputs.fraction[record, s] * model.tick_s
    q = quaternion_product(attitude(now), quaternion_from_vector(turn[0] * since, turn[1] * since, turn[2] * since))
    arm = rotate(q, lever[0], lever[1], lever[2])
    rate = rotate(q, turn[0], turn[1], turn[2])
    swing = (
        rate[1] * arm[2] - rate[2] * arm[1],
        rate[2] * arm[0] - rate[0] * arm[2],
        rate[0] * arm[1] - rate[1] * arm[0],
    )
    for i in range(3):
        velocity = now[3 + i] + acceleration[i] * since
        position = now[i] + (now[3 + i] + 0.5 * acceleration[i] * since) * since - arm[i]
        outputs.velocity_m_s[record, s, i] = velocity - swing[i]
        outputs.turn_rad_s[record, s, i] = rate[i]
        outputs.position_m[record, s, 0, i] = position
        for mode in range(1, MODES):
            outputs.position_m[record, s, mode, i] = position + state.offset[s, mode - 1, i]
    for mode in range(MODES):
        shown = q
        if mode > 0:
            offset = state.offset[s, mode - 1]
            shown = quaternion_product(quaternion_from_vector(offset[3], offset[4], offset[5]), q)
        for i in range(4):
            outputs.tracker_from_station[record, s, mode, i] = shown[i]
    outputs.report[record, s] = state.report[s]


@compiled
def add_to_offset(offset: Floats, moved: Floats, x: float, y: float, z: float) -> None:
    """Add the opposite of a correction to an offset (6,): metres, then a rotation vector [rad] in the tracker's axes.

    `moved` (3,) is how far the station's origin moved [m], (x, y, z) the rotation vector of the turn.
    """
    for i in range(3):
        offset[i] -= moved[i]
    q = quaternion_product(quaternion_from_vector(offset[3], offset[4], offset[5]), quaternion_from_vector(-x, -y, -z))
    offset[3], offset[4], offset[5] = rotation_vector(q)


@compiled
def decay_offsets(offsets: Floats, duration_s: float, speed_m_s: float, turn_rad_s: float) -> None:
    """Let the offsets (2, 6) of modes 1 and 2 decay."""
    for mode in range(2):
        rate = 1.0 / _DECAY_S if mode == 0 else min(speed_m_s / _DECAY_M + turn_rad_s / _DECAY_RAD, 1.0 / _SLOWEST_S)
        factor = np.exp(-rate * duration_s)
        for i in range(6):
            offsets[mode, i] *= factor


@compiled
def decay_slot(model: FilterModel, state: FilterState, s: int) -> None:
    """Let the offsets of a station decay over a slot, at the speed and turn rate of its end."""
    motion, turn = state.motion[s, TICKS_PER_SLOT], state.turn_rad_s[s]
    speed = np.sqrt(motion[3] ** 2 + motion[4] ** 2 + motion[5] ** 2)
    decay_offsets(
        state.offset[s], TICKS_PER_SLOT * model.tick_s, speed, np.sqrt(turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2)
    )
