"""The filter of each station, compiled: inertia at every tick, ranges at the end of every slot.

Each station has its own error-state filter at its inertial unit and depends on no other one. A range belongs to the
moment at which its sound arrived. It is compared with the motion at that moment, between two ticks, and its slope is by
the error at the slot's end.
"""

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.core.compiled import compiled
from harness.core.compiled_rotations import Vector, quaternion_from_vector, quaternion_product, rotate
from harness.simulate.physics.acquisition import integrate_path, level_attitude, solve_position
from harness.simulate.physics.filter_record import MODES, add_to_offset, decay_slot, write_record
from harness.simulate.physics.filter_state import FilterModel, FilterState, Outputs, Workspace, range_variance
from harness.simulate.physics.schedule import TICKS_PER_SLOT
from harness.simulate.physics.strapdown import (
    ERRORS,
    MOTION_ERRORS,
    add_process_noise,
    add_tick,
    attitude,
    attitude_sigma_rad,
    integrate,
    joseph_update,
    position_sigma_m,
    project,
    propagate_covariance,
    reset_attitude,
    set_attitude,
)
from harness.simulate.physics.tracking_status import LOST, TENTATIVE, update_status
from harness.simulate.readings import GRAVITY_M_S2

_SATURATION_SHARE = 0.3
"""Standard deviation of what a sensor at its limit leaves out, as a share of the limit [choice]."""
_CORRELATION_S = 0.2
"""Time over which a motion keeps its direction, and so the error of scale and misalignment its sign [s] [choice]."""
_FIX_SIGMA_M, _FIX_SIGMA_RAD = 0.1, 0.3
"""Largest standard deviations of a fix: position [m] and attitude [rad] [choice]."""
_ATTEMPT_SLOTS = 8
"""Slots between two attempts of a fix; they must not follow the turn of the emitters [choice]."""


@compiled
def filter_stations(
    model: FilterModel,
    state: FilterState,
    first_slot: int,
    emitter: Ints,
    angle_rad: Floats,
    velocity_m_s: Floats,
    range_m: Floats,
    outputs: Outputs,
) -> None:
    """Advance all stations over a block of slots; see `FusionFilter.filter_block`."""
    work = Workspace(
        np.zeros((9, 9)),
        np.empty((MOTION_ERRORS, ERRORS)),
        np.empty((4, ERRORS)),
        np.empty((TICKS_PER_SLOT, 3)),
        np.empty(3),
    )
    for s in range(len(state.motion)):
        record = 0
        while record < len(outputs.tick) and outputs.tick[record, s] < first_slot * TICKS_PER_SLOT:
            record += 1
        for f in range(len(range_m)):
            slot, t = first_slot + f, f * TICKS_PER_SLOT
            inertia = angle_rad[t : t + TICKS_PER_SLOT, s], velocity_m_s[t : t + TICKS_PER_SLOT, s]
            state.motion[s, 0] = state.motion[s, TICKS_PER_SLOT]
            first_turn = as_vector(state.turn_rad_s[s])
            first_acceleration = as_vector(state.acceleration_m_s2[s])
            predict_slot(model, state, s, inertia, work)
            while record < len(outputs.tick) and outputs.tick[record, s] < (slot + 1) * TICKS_PER_SLOT:
                k = outputs.tick[record, s] - slot * TICKS_PER_SLOT
                turn, acceleration = first_turn, first_acceleration
                if k > 0:
                    by, angles = 1.0 / model.tick_s, work.angles
                    turn = by * angles[k - 1, 0], by * angles[k - 1, 1], by * angles[k - 1, 2]
                    before, after = state.motion[s, k - 1], state.motion[s, k]
                    acceleration = by * (after[3] - before[3]), by * (after[4] - before[4]), by * (after[5] - before[5])
                write_record(model, state, s, k, turn, acceleration, outputs, record)
                record += 1
            propagate_covariance(state.covariance[s], work.transition, TICKS_PER_SLOT * model.tick_s, work.product)
            add_slot_noise(model, state.covariance[s], inertia, work)
            if state.status[s, 0] == LOST:
                acquire_slot(model, state, s, slot, emitter[f], range_m[f, s], work)
            else:
                update_slot(model, state, s, slot, emitter[f], range_m[f, s], work)
            update_status(model, state, s, slot)
            decay_slot(model, state, s)


@compiled
def as_vector(array: Floats) -> Vector:
    """Three numbers of an array as a tuple, which keeps them."""
    return array[0], array[1], array[2]


@compiled
def predict_slot(
    model: FilterModel, state: FilterState, s: int, inertia: tuple[Floats, Floats], work: Workspace
) -> None:
    """Integrate the increments of a slot, (5, 3) each; sets its transition, corrected angles and mean force."""
    angle_rad, velocity_m_s = inertia
    angles, force = work.angles, work.force
    bias, dt, lost = state.bias[s], model.tick_s, state.status[s, 0] == LOST
    work.transition[:] = 0.0
    force[:] = 0.0
    for k in range(TICKS_PER_SLOT):
        before, after = state.motion[s, k], state.motion[s, k + 1]
        for i in range(3):
            angles[k, i] = angle_rad[k, i] - bias[i] * dt
        velocity = (
            velocity_m_s[k, 0] - bias[3] * dt,
            velocity_m_s[k, 1] - bias[4] * dt,
            velocity_m_s[k, 2] - bias[5] * dt,
        )
        gained = integrate(before, as_vector(angles[k]), velocity, dt, after)
        if state.status[s, 1] == 1:
            after[:6] = before[:6]
        add_tick(work.transition, attitude(before), gained, dt)
        if lost:
            integrate_path(state.acquisition.path[s], gained[0], gained[1], gained[2], dt)
        for i in range(3):
            force[i] += gained[i] / (TICKS_PER_SLOT * dt)
            state.turn_rad_s[s, i] = angles[k, i] / dt
            state.acceleration_m_s2[s, i] = (after[3 + i] - before[3 + i]) / dt


@compiled
def add_slot_noise(model: FilterModel, covariance: Floats, inertia: tuple[Floats, Floats], work: Workspace) -> None:
    """Add the noise of the sensors, and that of scale and misalignment, which grows with the motion of the slot.

    A sensor at its limit measures too little, by an unknown part of the limit.
    Such an error keeps its sign while the motion goes on, so its density is its variance times a correlation time.
    Where the station turns, gravity changes its place among the axes, and so the accelerometers' apparent bias.
    """
    duration, angles, force = TICKS_PER_SLOT * model.tick_s, work.angles, work.force
    turn, change = 0.0, force[0] ** 2 + force[1] ** 2 + (force[2] + GRAVITY_M_S2) ** 2
    for i in range(3):
        total = 0.0
        for k in range(TICKS_PER_SLOT):
            total += angles[k, i]
        turn += (total / duration) ** 2
    density = np.empty(4)
    density[:] = model.noise
    scale = model.inertial_scale**2 * _CORRELATION_S
    density[0] += scale * turn
    density[1] += scale * change
    density[3] += scale * turn * GRAVITY_M_S2**2
    for sensor in range(2):
        clipped = count_saturated(inertia[sensor], model.limit[sensor] * model.tick_s) / TICKS_PER_SLOT
        density[sensor] += clipped * duration * (_SATURATION_SHARE * model.limit[sensor]) ** 2
    add_process_noise(covariance, duration, density)


@compiled
def count_saturated(increments: Floats, limit: float) -> int:
    """Number of increments (5, 3) with an axis at its limit."""
    total = 0
    for k in range(len(increments)):
        clipped = False
        for i in range(3):
            clipped = clipped or abs(increments[k, i]) >= (1.0 - 1e-9) * limit
        total += clipped
    return total


@compiled
def state_at_arrival(
    model: FilterModel, motion: Floats, angles: Floats, distance_m: float, arm_m: Floats, at: Floats
) -> float:
    """Set `at` (10,) to position of the inertial unit, microphone from it, and z axis, when a sound arrives.

    `motion` (6, 10) has the slot's ticks, `angles` (5, 3) the turns between them. Returns the time until the slot's end
    [s]. Positions between ticks are cubic.
    """
    ticks = min(max(distance_m / model.ranging.speed_m_s / model.tick_s, 0.0), TICKS_PER_SLOT - 1e-9)
    k = int(ticks)
    u = ticks - k
    before, after = motion[k], motion[k + 1]
    a, b = (1.0 + 2.0 * u) * (1.0 - u) ** 2, u * u * (3.0 - 2.0 * u)
    c, d = u * (1.0 - u) ** 2 * model.tick_s, u * u * (u - 1.0) * model.tick_s
    for i in range(3):
        at[i] = a * before[i] + b * after[i] + c * before[3 + i] + d * after[3 + i]
    q = quaternion_product(
        attitude(before), quaternion_from_vector(u * angles[k, 0], u * angles[k, 1], u * angles[k, 2])
    )
    at[3], at[4], at[5] = rotate(q, arm_m[0], arm_m[1], arm_m[2])
    at[6], at[7], at[8] = rotate(q, 0.0, 0.0, 1.0)
    return (TICKS_PER_SLOT - ticks) * model.tick_s


@compiled
def update_slot(
    model: FilterModel, state: FilterState, s: int, slot: int, emitter: int, range_m: Floats, work: Workspace
) -> None:
    """Correct a station with the ranges (2,) of a slot, one after the other; NaN where nothing was heard."""
    ranging, covariance, motion, force = model.ranging, state.covariance[s], state.motion[s], work.force
    vectors = work.vectors
    error, slope, column, rest = vectors[0], vectors[1], vectors[2], vectors[3]
    error[:] = 0.0
    received, rejected, late = 0, 0, 0
    at = np.empty(9)
    for m in range(len(range_m)):
        if np.isnan(range_m[m]):
            continue
        received += 1
        remaining_s = state_at_arrival(model, motion, work.angles, range_m[m], model.ranging.arm_m[s, m], at)
        x = at[0] + at[3] - ranging.emitter_m[emitter, 0]
        y = at[1] + at[4] - ranging.emitter_m[emitter, 1]
        z = at[2] + at[5] - ranging.emitter_m[emitter, 2]
        distance = np.sqrt(x * x + y * y + z * z) + 1e-12
        x, y, z = x / distance, y / distance, z / distance
        noise = range_variance(ranging, emitter, distance, x, y, z, -(at[6] * x + at[7] * y + at[8] * z))
        slope[0], slope[1], slope[2] = x, y, z
        slope[3], slope[4], slope[5] = -remaining_s * x, -remaining_s * y, -remaining_s * z
        half = 0.5 * remaining_s * remaining_s
        ax, ay, az = at[3] - half * force[0], at[4] - half * force[1], at[5] - half * force[2]
        slope[6], slope[7], slope[8] = ay * z - az * y, az * x - ax * z, ax * y - ay * x
        innovation = range_m[m] - distance
        for i in range(MOTION_ERRORS):
            innovation -= slope[i] * error[i]
        total = project(covariance, slope, column) + noise
        if innovation * innovation > model.gate * model.gate * total:
            rejected += 1
            late += innovation > 0.0
            continue
        state.accepted[s, emitter] = slot
        state.nis[s, 0] += innovation * innovation / total
        state.nis[s, 1] += 1.0
        for i in range(ERRORS):
            error[i] += column[i] * (innovation / total)
        joseph_update(covariance, slope, column, total, noise, rest)
    count_ranges(state, s, slot, received, rejected, late)
    if received > rejected:
        apply_error_state(model, state, s, error)


@compiled
def count_ranges(state: FilterState, s: int, slot: int, received: int, rejected: int, late: int) -> None:
    """Enter the ranges of a slot; late ones are among the rejected."""
    place = slot % state.counts.shape[2]
    state.counts[0, s, place] = received
    state.counts[1, s, place] = rejected
    state.counts[2, s, place] = late
    status = state.status[s]
    status[2] = 0 if received > rejected else status[2] + 1
    status[3] += received - rejected
    status[4] += rejected - late


@compiled
def apply_error_state(model: FilterModel, state: FilterState, s: int, error: Floats) -> None:
    """Move a station's estimate by an error (15,); the offsets of the enhancement modes keep the output in place."""
    now, lever = state.motion[s, TICKS_PER_SLOT], model.lever_m
    moved = np.empty(3)
    x, y, z = rotate(attitude(now), lever[0], lever[1], lever[2])
    for i in range(6):
        now[i] += error[i]
        state.bias[s, i] += error[9 + i]
    set_attitude(now, quaternion_product(quaternion_from_vector(error[6], error[7], error[8]), attitude(now)))
    u, v, w = rotate(attitude(now), lever[0], lever[1], lever[2])
    moved[0], moved[1], moved[2] = error[0] - u + x, error[1] - v + y, error[2] - w + z
    reset_attitude(state.covariance[s], error[6], error[7], error[8])
    for mode in range(MODES - 1):
        add_to_offset(state.offset[s, mode], moved, error[6], error[7], error[8])


@compiled
def acquire_slot(
    model: FilterModel, state: FilterState, s: int, slot: int, emitter: int, range_m: Floats, work: Workspace
) -> None:
    """Collect the ranges (2,) of a slot for a station that is lost, and try a fix."""
    acquisition, force, slot_s = state.acquisition, work.force, TICKS_PER_SLOT * model.tick_s
    motion, path = state.motion[s], acquisition.path[s]
    at = np.empty(9)
    received = 0
    for m in range(len(range_m)):
        if np.isnan(range_m[m]):
            continue
        received += 1
        remaining_s = state_at_arrival(model, motion, work.angles, range_m[m], model.ranging.arm_m[s, m], at)
        row = acquisition.ranges[s, acquisition.range_count[s] % acquisition.ranges.shape[1]]
        row[0], row[1], row[11] = path[6] - remaining_s, range_m[m], emitter
        for k in range(3):
            # The path at the arrival, back from the slot's end by the slot's mean force.
            row[2 + k] = path[k] - path[3 + k] * remaining_s + 0.5 * force[k] * remaining_s * remaining_s
        row[5:11] = at[3:9]
        acquisition.range_count[s] += 1
    count_ranges(state, s, slot, received, 0, 0)
    level_attitude(acquisition, s, motion[TICKS_PER_SLOT], force[0], force[1], force[2], slot_s)
    covariance = state.covariance[s]
    drift = covariance[9, 9] + covariance[10, 10] + covariance[11, 11]
    acquisition.tilt_variance[s] += slot_s * (model.noise[0] + drift * slot_s * acquisition.gravity[s, 4])
    if received == 0 or state.status[s, 5] < _ATTEMPT_SLOTS:
        return
    state.status[s, 5] = 0
    now = motion[TICKS_PER_SLOT].copy()
    trial = covariance.copy()
    if not solve_position(model.ranging, acquisition, s, model.window_s, now, trial):
        return
    if position_sigma_m(trial) > _FIX_SIGMA_M or attitude_sigma_rad(trial) > _FIX_SIGMA_RAD:
        return
    motion[TICKS_PER_SLOT] = now
    covariance[:] = trial
    state.offset[s] = 0.0
    state.nis[s] = 0.0
    status = state.status[s]
    status[:] = 0
    status[0] = TENTATIVE
