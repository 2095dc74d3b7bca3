"""The status of a station: lost, tentative, tracking or suspect, and what its records report (docs/is900.md 16.7)."""

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.core.compiled import compiled
from harness.simulate.physics.filter_state import AcquisitionState, FilterModel, FilterState
from harness.simulate.physics.schedule import TICKS_PER_SLOT
from harness.simulate.physics.strapdown import MOTION_ERRORS, attitude_sigma_rad, position_sigma_m

CONFIRMATION_RANGES, CONFIRMATION_SLOTS = 6, 12
"""Accepted ranges that confirm a fix, and the slots that it takes at least [choice]."""
_CONFIRMATION_EMITTERS = 4
"""Emitters whose ranges confirm a new one: three can agree with a wrong place [choice]. A suspect station had them."""
_LARGEST_REJECT_SHARE = 0.3
"""Share of early ranges, among those that are not late, that refutes one [choice]."""
_LARGEST_ATTITUDE_SIGMA_RAD = 0.1
"""Largest standard deviation of the attitude of a confirmed fix [rad] [choice]."""
_LARGEST_NIS = 2.0
"""Largest mean normalised squared innovation of the ranges that confirm a fix; it is 1 for a perfect model [choice]."""
_FEWEST_RANGES = 10
"""Ranges in a second below which no share of rejected ones is computed [choice]."""
_SUSPECT_SIGMA_M = 0.15
"""Standard deviation of the position at which a suspect station needs a new fix [choice]."""
_COAST_SIGMA_M = 0.5
"""Standard deviation of the position at which a lost station stops coasting [choice]."""
LOST_TILT_VARIANCE = 0.1
"""Variance of the tilt after ranges refuted it [rad^2] [choice]."""
LOST, TENTATIVE, TRACKING, SUSPECT = 0, 1, 2, 3
"""Without a fix; with a fix that further ranges have not yet confirmed; with a confirmed one; with one whose position
has become too uncertain. Records show quality 0 for all but the third."""
CYCLE_SLOTS = 6
"""Slots whose ranges `MP` counts: at most twelve ranges of two microphones (docs/is900.md 7)."""
LEAST_QUALITY = 1.0 / 255.0
"""Quality of a station that tracks: the least that a record tells from lost (docs/is900.md 7)."""


@compiled
def update_status(model: FilterModel, state: FilterState, s: int, slot: int) -> None:
    """Decide whether a station is lost or confirmed, and what its records report from now on."""
    status, counts, covariance = state.status[s], state.counts, state.covariance[s]
    sigma = position_sigma_m(covariance)
    status[5] += 1
    if status[0] == TRACKING:
        late = sum_window(counts[2, s], slot, model.reject_slots) if has_small_nis(state, s) else 0
        received = sum_window(counts[0, s], slot, model.reject_slots) - late
        rejected = sum_window(counts[1, s], slot, model.reject_slots) - late
        if received >= _FEWEST_RANGES and rejected > model.reject_share * received:
            reset_station(model, state, s)
        elif status[2] > model.coast_slots:
            mark_lost(state, s, tilt_variance_of(covariance))
        elif sigma > model.sigma_limit_m:
            flag_suspect(state, s)
    elif status[0] != LOST:
        count, suspect = status[3] + status[4], status[0] == SUSPECT
        if count >= CONFIRMATION_RANGES and status[4] > _LARGEST_REJECT_SHARE * count:
            reset_station(model, state, s)
        elif suspect and (status[2] > model.coast_slots or not sigma < _SUSPECT_SIGMA_M):
            mark_lost(state, s, tilt_variance_of(covariance))
        elif not suspect and (status[2] > model.confirmation_slots or not sigma < _COAST_SIGMA_M):
            mark_lost(state, s, LOST_TILT_VARIANCE)
        elif (
            status[3] >= CONFIRMATION_RANGES
            and (suspect or np.sum(state.accepted[s] > slot - status[5]) >= _CONFIRMATION_EMITTERS)
            and status[5] >= (CONFIRMATION_SLOTS if suspect else model.confirmation_slots)
            and sigma < model.sigma_limit_m
            and attitude_sigma_rad(covariance) < _LARGEST_ATTITUDE_SIGMA_RAD
        ):
            if has_small_nis(state, s):
                status[0] = TRACKING
            else:
                reset_station(model, state, s)
    if status[0] == LOST and not sigma < _COAST_SIGMA_M:
        freeze_position(state, s)
    received = sum_window(counts[0, s], slot, CYCLE_SLOTS)
    rejected = sum_window(counts[1, s], slot, CYCLE_SLOTS)
    report = state.report[s]
    report[0] = tracking_quality(status[0], sigma, received, rejected, model.best_sigma_m)
    report[1], report[2], report[3] = sigma, received, rejected


@compiled
def has_small_nis(state: FilterState, s: int) -> bool:
    """Whether the ranges accepted since the fix fit, so that late ones may be taken for echoes."""
    return bool(state.nis[s, 0] < _LARGEST_NIS * state.nis[s, 1])


@compiled
def mark_lost(state: FilterState, s: int, tilt_variance: float) -> None:
    """Declare a station lost."""
    state.status[s, 0] = LOST
    reset_acquisition(state.acquisition, s, tilt_variance)


@compiled
def reset_acquisition(acquisition: AcquisitionState, s: int, tilt_variance: float) -> None:
    """Forget what station s has collected."""
    acquisition.range_count[s] = 0
    acquisition.path[s] = 0.0
    acquisition.gravity[s] = 0.0
    acquisition.tilt_variance[s] = tilt_variance


@compiled
def flag_suspect(state: FilterState, s: int) -> None:
    """Report a station as lost whose position is too uncertain; ranges go on to correct it until it is sure again."""
    status = state.status[s]
    status[0] = SUSPECT
    status[3], status[4], status[5] = 0, 0, 0
    state.nis[s] = 0.0


@compiled
def tilt_variance_of(covariance: Floats) -> float:
    """Variance of the tilt about each horizontal axis that a station keeps when it is lost [rad^2]."""
    out: float = max(0.5 * (covariance[6, 6] + covariance[7, 7]), 1e-6)
    return out


@compiled
def reset_station(model: FilterModel, state: FilterState, s: int) -> None:
    """Declare a station lost whose ranges contradict it: velocity, tilt and biases are then worth nothing either."""
    mark_lost(state, s, LOST_TILT_VARIANCE)
    freeze_position(state, s)
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
def freeze_position(state: FilterState, s: int) -> None:
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
def sum_window(counts: Ints, slot: int, slots: int) -> int:
    """Sum of the counts of the last slots, up to `slot`, in a ring (N,) with one entry per slot."""
    total = 0
    for k in range(slots):
        total += counts[(slot - k) % len(counts)]
    return total


@compiled
def tracking_quality(state: int, sigma_m: float, received: int, rejected: int, best_sigma_m: float) -> float:
    """Quality in 0..1 [choice]: `best_sigma_m` over the position's standard deviation [m], at most 1.

    The share of accepted ranges scales it by 0.5 to 1. A station without a confirmed fix has 0.
    """
    if state != TRACKING:
        return 0.0
    share = (received - rejected) / received if received > 0 else 0.0
    precision = min(1.0, best_sigma_m / sigma_m) if sigma_m > 0.0 else 1.0
    return max(LEAST_QUALITY, precision * (0.5 + 0.5 * share))
