"""Records of a station, written from the filter's state between two ticks."""

from harness.core.compiled import compiled
from harness.core.compiled_rotations import Vector, quaternion_from_vector, quaternion_product, rotate
from harness.simulate.physics.enhancement import MODES
from harness.simulate.physics.filter_state import FilterModel, FilterState, Outputs
from harness.simulate.physics.strapdown import attitude


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
