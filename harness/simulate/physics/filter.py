"""The filter of each station, compiled: inertia at every tick, ranges at the end of every slot.

Each station has its own error-state filter at its inertial unit and depends on no other one. A range belongs to the
moment at which its sound arrived. It is compared with the motion at that moment, between two ticks, and its slope is by
the error at the slot's end.
"""

from typing import NamedTuple

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.core.compiled import compiled
from harness.simulate.physics.acquisition import (
    LOST_TILT_VARIANCE,
    Search,
    add_force,
    begin_search,
    fix,
    level_attitude,
)
from harness.simulate.physics.enhancement import MODES, add_to_offset, decay
from harness.simulate.physics.error_state import (
    ERRORS,
    MOTION_ERRORS,
    add_noise,
    add_tick,
    attitude_sigma_rad,
    position_sigma_m,
    project,
    propagate,
    reset_attitude,
    update,
)
from harness.simulate.physics.ranging_model import RangingModel, range_variance
from harness.simulate.physics.schedule import TICKS_PER_SLOT
from harness.simulate.physics.status import CONFIRMING, CYCLE_SLOTS, DOUBTED, LOST, TRACKING, quality, sum_last
from harness.simulate.physics.strapdown import (
    Vector,
    attitude,
    exponential,
    integrate,
    product,
    rotated,
    set_attitude,
)
from harness.simulate.readings import GRAVITY_M_S2

CONFIRMING_RANGES, CONFIRMING_SLOTS = 6, 12
"""Accepted ranges that confirm a fix, and the slots that it takes at least [choice]."""
_CONFIRMING_REJECTS = 0.3
"""Share of rejected ranges that refutes one [choice]."""
_FEWEST_JUDGED = 10
"""Ranges in a second below which no share of rejected ones is judged [choice]."""
_DOUBTED_SIGMA_M = 0.15
"""Standard deviation of the position at which a doubted station needs a new fix [choice]."""
_COAST_SIGMA_M = 0.5
"""Standard deviation of the position at which a lost station stops coasting [choice]."""
_CLIPPED_SHARE = 0.3
"""Standard deviation of what a sensor at its limit leaves out, as a share of the limit [choice]."""
_CORRELATION_S = 0.2
"""Time over which a motion keeps its direction, and so the error of scale and misalignment its sign [s] [choice]."""
_FIX_SIGMA_M, _FIX_SIGMA_RAD, _CONFIRMED_SIGMA_RAD = 0.1, 0.3, 0.1
"""Largest standard deviations of a fix: position [m], attitude and attitude once confirmed [rad] [choice]."""
_CONFIRMED_NIS = 2.0
"""Largest mean normalised squared innovation of the ranges that confirm a fix; it is 1 for a perfect model [choice]."""
_ATTEMPT_SLOTS = 8
"""Slots between two attempts of a fix; they must not follow the turn of the emitters [choice]."""


class FilterModel(NamedTuple):
    """Constants of the filter, shared by all stations."""

    tick_s: float
    lever_m: Floats
    """(3,) inertial unit in the station's axes [m]."""
    gate: float
    noise: Floats
    """(4,) noise densities of gyroscopes, accelerometers and their biases, x^2 per second."""
    bias_variance: Floats
    """(2,) variances of the biases at switch-on."""
    inertial_scale: float
    limit: Floats
    """(2,) largest values of gyroscopes [rad/s] and accelerometers [m/s^2]."""
    sigma_limit_m: float
    reject_share: float
    coast_slots: int
    judged_slots: int
    """Slots in a second."""
    confirm_slots: int
    window_s: float
    """Time whose ranges make a fix."""
    best_sigma_m: float
    """Standard deviation of the position up to which the quality is 1."""


class FilterState(NamedTuple):
    """State of S stations' filters; a slot has 5 ticks."""

    motion: Floats
    """(S, 6, 10) position, velocity and attitude of the inertial unit at the ticks of the last slot, 5 is its end."""
    bias: Floats
    """(S, 6) of gyroscopes [rad/s] and accelerometers [m/s^2]."""
    covariance: Floats
    """(S, 15, 15)."""
    turn_rad_s: Floats
    """(S, 3) turn rate in the last interval, in the station's axes."""
    acceleration_m_s2: Floats
    """(S, 3) acceleration in the last interval, in the tracker's axes."""
    offset: Floats
    """(S, 2, 6) offsets of enhancement modes 1 and 2."""
    status: Ints
    """(S, 6) LOST, CONFIRMING, TRACKING or DOUBTED; whether the position is frozen; slots since an accepted range;
    accepted and rejected ranges since the fix or the doubt; slots since then, or since the last attempt of a fix."""
    counts: Ints
    """(2, S, slots of a second) ranges received and rejected, in a ring."""
    report: Floats
    """(S, 4) quality, standard deviation of the position [m], ranges received and rejected in the last cycle."""
    nis: Floats
    """(S, 2) sum of normalised squared innovations of accepted ranges since the fix, and their number."""


class Outputs(NamedTuple):
    """What E records of S stations show, and when they are made."""

    tick: Ints
    """(E, S) last tick before a record, ascending."""
    fraction: Floats
    """(E, S) part of the tick that had passed, in 0..1."""
    position_m: Floats
    """(E, S, 3 modes, 3) the station's origin, in each enhancement mode."""
    tracker_from_station: Floats
    """(E, S, 3 modes, 4)."""
    velocity_m_s: Floats
    """(E, S, 3) of the origin."""
    turn_rad_s: Floats
    """(E, S, 3) angular velocity in the tracker's axes."""
    report: Floats
    """(E, S, 4) quality, standard deviation of the position [m], ranges received and rejected in the last cycle."""


@compiled
def advance(
    model: FilterModel,
    ranging: RangingModel,
    state: FilterState,
    search: Search,
    first_slot: int,
    angle_rad: Floats,
    velocity_m_s: Floats,
    range_m: Floats,
    outputs: Outputs,
) -> None:
    """Advance all stations over a block of slots; see `FusionFilter.advance`."""
    transition, scratch = np.zeros((9, 9)), np.empty((MOTION_ERRORS, ERRORS))
    vectors, angles, force = np.empty((4, ERRORS)), np.empty((TICKS_PER_SLOT, 3)), np.empty(3)
    for s in range(len(state.motion)):
        record = 0
        while record < len(outputs.tick) and outputs.tick[record, s] < first_slot * TICKS_PER_SLOT:
            record += 1
        for f in range(len(range_m)):
            slot, t = first_slot + f, f * TICKS_PER_SLOT
            inertia = angle_rad[t : t + TICKS_PER_SLOT, s], velocity_m_s[t : t + TICKS_PER_SLOT, s]
            transition[:] = 0.0
            state.motion[s, 0] = state.motion[s, TICKS_PER_SLOT]
            first_turn = state.turn_rad_s[s, 0], state.turn_rad_s[s, 1], state.turn_rad_s[s, 2]
            first_acceleration = (
                state.acceleration_m_s2[s, 0],
                state.acceleration_m_s2[s, 1],
                state.acceleration_m_s2[s, 2],
            )
            predict_slot(model, state, search, s, inertia[0], inertia[1], transition, angles, force)
            while record < len(outputs.tick) and outputs.tick[record, s] < (slot + 1) * TICKS_PER_SLOT:
                k = outputs.tick[record, s] - slot * TICKS_PER_SLOT
                turn, acceleration = first_turn, first_acceleration
                if k > 0:
                    by = 1.0 / model.tick_s
                    turn = by * angles[k - 1, 0], by * angles[k - 1, 1], by * angles[k - 1, 2]
                    before, after = state.motion[s, k - 1], state.motion[s, k]
                    acceleration = by * (after[3] - before[3]), by * (after[4] - before[4]), by * (after[5] - before[5])
                write_record(model, state, s, k, turn, acceleration, outputs, record)
                record += 1
            propagate(state.covariance[s], transition, TICKS_PER_SLOT * model.tick_s, scratch)
            add_slot_noise(model, state.covariance[s], angles, force, inertia)
            emitter = slot % len(ranging.emitter_m)
            if state.status[s, 0] == LOST:
                search_slot(model, ranging, state, search, s, slot, emitter, range_m[f, s], angles, force)
            else:
                correct(model, ranging, state, search, s, slot, emitter, range_m[f, s], angles, force, vectors)
            finish_slot(model, state, search, s, slot)


@compiled
def predict_slot(
    model: FilterModel,
    state: FilterState,
    search: Search,
    s: int,
    angle_rad: Floats,
    velocity_m_s: Floats,
    transition: Floats,
    angles: Floats,
    force: Floats,
) -> None:
    """Integrate the increments (5, 3) of a slot; sets its transition, corrected angles (5, 3) and mean force (3,)."""
    bias, dt, lost = state.bias[s], model.tick_s, state.status[s, 0] == LOST
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
        gained = integrate(before, (angles[k, 0], angles[k, 1], angles[k, 2]), velocity, dt, after)
        if state.status[s, 1] == 1:
            after[:6] = before[:6]
        add_tick(transition, attitude(before), gained, dt)
        if lost:
            add_force(search.path[s], gained[0], gained[1], gained[2], dt)
        for i in range(3):
            force[i] += gained[i] / (TICKS_PER_SLOT * dt)
            state.turn_rad_s[s, i] = angles[k, i] / dt
            state.acceleration_m_s2[s, i] = (after[3 + i] - before[3 + i]) / dt


@compiled
def add_slot_noise(
    model: FilterModel, covariance: Floats, angles: Floats, force: Floats, inertia: tuple[Floats, Floats]
) -> None:
    """Add the noise of the sensors, and that of scale and misalignment, which grows with the motion of the slot.

    A sensor at its limit measures too little, by an unknown part of the limit.
    Such an error keeps its sign while the motion goes on, so its density is its variance times a correlation time.
    Where the station turns, gravity changes its place among the axes, and so the accelerometers' apparent bias.
    """
    duration = TICKS_PER_SLOT * model.tick_s
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
        clipped = count_at_limit(inertia[sensor], model.limit[sensor] * model.tick_s) / TICKS_PER_SLOT
        density[sensor] += clipped * duration * (_CLIPPED_SHARE * model.limit[sensor]) ** 2
    add_noise(covariance, duration, density)


@compiled
def count_at_limit(increments: Floats, limit: float) -> int:
    """Number of increments (5, 3) with an axis at its limit."""
    total = 0
    for k in range(len(increments)):
        clipped = False
        for i in range(3):
            clipped = clipped or abs(increments[k, i]) >= (1.0 - 1e-9) * limit
        total += clipped
    return total


@compiled
def arrival(
    model: FilterModel,
    ranging: RangingModel,
    motion: Floats,
    angles: Floats,
    distance_m: float,
    arm_m: Floats,
    at: Floats,
) -> float:
    """Set `at` (10,) to position of the inertial unit, microphone from it, and z axis, when a sound arrives.

    `motion` (6, 10) has the slot's ticks, `angles` (5, 3) the turns between them. Returns the time until the slot's end
    [s]. Positions between ticks are cubic.
    """
    ticks = min(max(distance_m / ranging.speed_m_s / model.tick_s, 0.0), TICKS_PER_SLOT - 1e-9)
    k = int(ticks)
    u = ticks - k
    before, after = motion[k], motion[k + 1]
    a, b = (1.0 + 2.0 * u) * (1.0 - u) ** 2, u * u * (3.0 - 2.0 * u)
    c, d = u * (1.0 - u) ** 2 * model.tick_s, u * u * (u - 1.0) * model.tick_s
    for i in range(3):
        at[i] = a * before[i] + b * after[i] + c * before[3 + i] + d * after[3 + i]
    q = product(attitude(before), exponential(u * angles[k, 0], u * angles[k, 1], u * angles[k, 2]))
    at[3], at[4], at[5] = rotated(q, arm_m[0], arm_m[1], arm_m[2])
    at[6], at[7], at[8] = rotated(q, 0.0, 0.0, 1.0)
    return (TICKS_PER_SLOT - ticks) * model.tick_s


@compiled
def correct(
    model: FilterModel,
    ranging: RangingModel,
    state: FilterState,
    search: Search,
    s: int,
    slot: int,
    emitter: int,
    range_m: Floats,
    angles: Floats,
    force: Floats,
    vectors: Floats,
) -> None:
    """Correct a station with the ranges (2,) of a slot, one after the other; NaN where nothing was heard."""
    covariance, motion = state.covariance[s], state.motion[s]
    error, slope, column, rest = vectors[0], vectors[1], vectors[2], vectors[3]
    error[:] = 0.0
    received, rejected = 0, 0
    at = np.empty(9)
    for m in range(len(range_m)):
        if np.isnan(range_m[m]):
            continue
        received += 1
        lag = arrival(model, ranging, motion, angles, range_m[m], ranging.arm_m[m], at)
        x = at[0] + at[3] - ranging.emitter_m[emitter, 0]
        y = at[1] + at[4] - ranging.emitter_m[emitter, 1]
        z = at[2] + at[5] - ranging.emitter_m[emitter, 2]
        distance = np.sqrt(x * x + y * y + z * z) + 1e-12
        x, y, z = x / distance, y / distance, z / distance
        noise = range_variance(ranging, emitter, distance, x, y, z, -(at[6] * x + at[7] * y + at[8] * z))
        slope[0], slope[1], slope[2] = x, y, z
        slope[3], slope[4], slope[5] = -lag * x, -lag * y, -lag * z
        half = 0.5 * lag * lag
        ax, ay, az = at[3] - half * force[0], at[4] - half * force[1], at[5] - half * force[2]
        slope[6], slope[7], slope[8] = ay * z - az * y, az * x - ax * z, ax * y - ay * x
        innovation = range_m[m] - distance
        for i in range(MOTION_ERRORS):
            innovation -= slope[i] * error[i]
        total = project(covariance, slope, column) + noise
        if innovation * innovation > model.gate * model.gate * total:
            rejected += 1
            continue
        state.nis[s, 0] += innovation * innovation / total
        state.nis[s, 1] += 1.0
        for i in range(ERRORS):
            error[i] += column[i] * (innovation / total)
        update(covariance, slope, column, total, noise, rest)
    count(state, s, slot, received, rejected)
    if received > rejected:
        inject(model, state, s, error)


@compiled
def count(state: FilterState, s: int, slot: int, received: int, rejected: int) -> None:
    """Enter the ranges of a slot."""
    place = slot % state.counts.shape[2]
    state.counts[0, s, place] = received
    state.counts[1, s, place] = rejected
    status = state.status[s]
    status[2] = 0 if received > rejected else status[2] + 1
    status[3] += received - rejected
    status[4] += rejected


@compiled
def inject(model: FilterModel, state: FilterState, s: int, error: Floats) -> None:
    """Move a station's estimate by an error (15,); the offsets of the enhancement modes keep the output in place."""
    now, lever = state.motion[s, TICKS_PER_SLOT], model.lever_m
    moved = np.empty(3)
    x, y, z = rotated(attitude(now), lever[0], lever[1], lever[2])
    for i in range(6):
        now[i] += error[i]
        state.bias[s, i] += error[9 + i]
    set_attitude(now, product(exponential(error[6], error[7], error[8]), attitude(now)))
    u, v, w = rotated(attitude(now), lever[0], lever[1], lever[2])
    moved[0], moved[1], moved[2] = error[0] - u + x, error[1] - v + y, error[2] - w + z
    reset_attitude(state.covariance[s], error[6], error[7], error[8])
    for mode in range(MODES - 1):
        add_to_offset(state.offset[s, mode], moved, error[6], error[7], error[8])


@compiled
def search_slot(
    model: FilterModel,
    ranging: RangingModel,
    state: FilterState,
    search: Search,
    s: int,
    slot: int,
    emitter: int,
    range_m: Floats,
    angles: Floats,
    force: Floats,
) -> None:
    """Collect the ranges (2,) of a slot for a station that is lost, and try a fix."""
    motion, path, slot_s = state.motion[s], search.path[s], TICKS_PER_SLOT * model.tick_s
    at = np.empty(9)
    received = 0
    for m in range(len(range_m)):
        if np.isnan(range_m[m]):
            continue
        received += 1
        lag = arrival(model, ranging, motion, angles, range_m[m], ranging.arm_m[m], at)
        row = search.heard[s, search.stored[s] % search.heard.shape[1]]
        row[0], row[1], row[11] = path[6] - lag, range_m[m], emitter
        for k in range(3):
            # The path at the arrival, back from the slot's end by the slot's mean force.
            row[2 + k] = path[k] - path[3 + k] * lag + 0.5 * force[k] * lag * lag
        row[5:11] = at[3:9]
        search.stored[s] += 1
    count(state, s, slot, received, 0)
    level_attitude(search, s, motion[TICKS_PER_SLOT], force[0], force[1], force[2], slot_s)
    covariance = state.covariance[s]
    drift = covariance[9, 9] + covariance[10, 10] + covariance[11, 11]
    search.tilt_variance[s] += slot_s * (model.noise[0] + drift * slot_s * search.gravity[s, 4])
    if received == 0 or state.status[s, 5] < _ATTEMPT_SLOTS:
        return
    state.status[s, 5] = 0
    now = motion[TICKS_PER_SLOT].copy()
    trial = covariance.copy()
    if not fix(ranging, search, s, model.window_s, now, trial):
        return
    if position_sigma_m(trial) > _FIX_SIGMA_M or attitude_sigma_rad(trial) > _FIX_SIGMA_RAD:
        return
    motion[TICKS_PER_SLOT] = now
    covariance[:] = trial
    state.offset[s] = 0.0
    state.nis[s] = 0.0
    status = state.status[s]
    status[:] = 0
    status[0] = CONFIRMING


@compiled
def finish_slot(model: FilterModel, state: FilterState, search: Search, s: int, slot: int) -> None:
    """Decide whether a station is lost or confirmed, and what its records report from now on."""
    status, counts, covariance = state.status[s], state.counts, state.covariance[s]
    sigma = position_sigma_m(covariance)
    status[5] += 1
    if status[0] == TRACKING:
        received = sum_last(counts[0, s], slot, model.judged_slots)
        rejected = sum_last(counts[1, s], slot, model.judged_slots)
        if received >= _FEWEST_JUDGED and rejected > model.reject_share * received:
            distrust(model, state, search, s)
        elif status[2] > model.coast_slots:
            lose(state, search, s, kept_tilt_variance(covariance))
        elif sigma > model.sigma_limit_m:
            doubt(state, s)
    elif status[0] != LOST:
        judged, doubted = status[3] + status[4], status[0] == DOUBTED
        if judged >= CONFIRMING_RANGES and status[4] > _CONFIRMING_REJECTS * judged:
            distrust(model, state, search, s)
        elif doubted and (status[2] > model.coast_slots or not sigma < _DOUBTED_SIGMA_M):
            lose(state, search, s, kept_tilt_variance(covariance))
        elif not doubted and (status[2] > model.confirm_slots or not sigma < _COAST_SIGMA_M):
            lose(state, search, s, LOST_TILT_VARIANCE)
        elif (
            status[3] >= CONFIRMING_RANGES
            and status[5] >= (CONFIRMING_SLOTS if doubted else model.confirm_slots)
            and sigma < model.sigma_limit_m
            and attitude_sigma_rad(covariance) < _CONFIRMED_SIGMA_RAD
        ):
            if state.nis[s, 0] < _CONFIRMED_NIS * state.nis[s, 1]:
                status[0] = TRACKING
            else:
                distrust(model, state, search, s)
    if status[0] == LOST and not sigma < _COAST_SIGMA_M:
        freeze(state, s)
    motion = state.motion[s, TICKS_PER_SLOT]
    speed = np.sqrt(motion[3] ** 2 + motion[4] ** 2 + motion[5] ** 2)
    turn = state.turn_rad_s[s]
    decay(state.offset[s], TICKS_PER_SLOT * model.tick_s, speed, np.sqrt(turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2))
    received = sum_last(counts[0, s], slot, CYCLE_SLOTS)
    rejected = sum_last(counts[1, s], slot, CYCLE_SLOTS)
    report = state.report[s]
    report[0] = quality(status[0], sigma, received, rejected, model.best_sigma_m)
    report[1], report[2], report[3] = sigma, received, rejected


@compiled
def lose(state: FilterState, search: Search, s: int, tilt_variance: float) -> None:
    """Declare a station lost."""
    state.status[s, 0] = LOST
    begin_search(search, s, tilt_variance)


@compiled
def doubt(state: FilterState, s: int) -> None:
    """Report a station as lost whose position is too uncertain; ranges go on to correct it until it is sure again."""
    status = state.status[s]
    status[0] = DOUBTED
    status[3], status[4], status[5] = 0, 0, 0
    state.nis[s] = 0.0


@compiled
def kept_tilt_variance(covariance: Floats) -> float:
    """Variance of the tilt about each horizontal axis that a station keeps when it is lost [rad^2]."""
    out: float = max(0.5 * (covariance[6, 6] + covariance[7, 7]), 1e-6)
    return out


@compiled
def distrust(model: FilterModel, state: FilterState, search: Search, s: int) -> None:
    """Declare a station lost whose ranges contradict it: velocity, tilt and biases are then worth nothing either."""
    lose(state, search, s, LOST_TILT_VARIANCE)
    freeze(state, s)
    state.bias[s] = 0.0
    set_bias_covariance(model, state.covariance[s])


@compiled
def set_bias_covariance(model: FilterModel, covariance: Floats) -> None:
    """Set the biases' part of P (15, 15) to that at switch-on."""
    covariance[MOTION_ERRORS:, :] = 0.0
    covariance[:, MOTION_ERRORS:] = 0.0
    for i in range(6):
        covariance[MOTION_ERRORS + i, MOTION_ERRORS + i] = model.bias_variance[i // 3]


@compiled
def freeze(state: FilterState, s: int) -> None:
    """Stop the position of a station that knows its motion no longer; its covariance stays bounded, too."""
    state.status[s, 1] = 1
    state.motion[s, TICKS_PER_SLOT, 3:6] = 0.0
    covariance = state.covariance[s]
    covariance[:MOTION_ERRORS, :] = 0.0
    covariance[:, :MOTION_ERRORS] = 0.0
    for i in range(3):
        covariance[i, i] = _COAST_SIGMA_M**2
        covariance[6 + i, 6 + i] = LOST_TILT_VARIANCE


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
    q = product(attitude(now), exponential(turn[0] * since, turn[1] * since, turn[2] * since))
    arm = rotated(q, lever[0], lever[1], lever[2])
    rate = rotated(q, turn[0], turn[1], turn[2])
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
            shown = product(exponential(offset[3], offset[4], offset[5]), q)
        for i in range(4):
            outputs.tracker_from_station[record, s, mode, i] = shown[i]
    outputs.report[record, s] = state.report[s]
