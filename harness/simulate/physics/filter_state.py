"""Constants, state and outputs of the stations' filters, for compiled loops."""

from typing import NamedTuple

from harness.core.arrays import Floats, Ints
from harness.core.compiled import compiled
from harness.simulate.physics.sound import level_db, noise_factor


class RangingModel(NamedTuple):
    """Constants of all stations, in the tracker's frame."""

    emitter_m: Floats
    """(J, 3) positions."""
    normal: Floats
    """(J, 3) unit vectors along which the emitters send."""
    arm_m: Floats
    """(S, M, 3) where the device assumes each station's microphones, from the inertial unit, in the station's axes."""
    speed_m_s: float
    """Assumed speed of sound."""
    absorption_db_per_m: float
    range_noise_m: float
    """Standard deviation of a range at 2 m on the axes."""
    range_scale: float
    """Standard deviation of the scale of a range."""
    survey_m: float
    """Standard deviation of an emitter's position."""
    reach_m: float
    """Largest distance from emitter to microphone."""
    cone_cos: float
    """Least cosine of the angle between an emitter's normal and its sound."""
    threshold_db: float
    """Lowest level that is heard."""


class FilterModel(NamedTuple):
    """Constants of the filter, shared by all stations."""

    ranging: RangingModel
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
    reject_slots: int
    """Slots in a second."""
    confirmation_slots: int
    window_s: float
    """Time whose ranges make a fix."""
    best_sigma_m: float
    """Standard deviation of the position up to which the quality is 1."""


class AcquisitionState(NamedTuple):
    """What S lost stations have collected."""

    ranges: Floats
    """(S, N, 12) ranges in a ring, the latest of the window: three turns of emitters, within the limits above."""
    range_count: Ints
    """(S,) ranges stored since the loss."""
    path: Floats
    """(S, 7) double and single integral of the specific force since the loss [m], [m/s], and its duration [s]."""
    gravity: Floats
    """(S, 5) running mean of the specific force [m/s^2], its variance, and the number of slots in them."""
    tilt_variance: Floats
    """(S,) variance of the attitude's tilt about each horizontal axis [rad^2]."""


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
    """(S, 6) LOST, TENTATIVE, TRACKING or SUSPECT; whether the position is frozen; slots since an accepted range;
    accepted and early ranges since the fix, or since it became suspect; slots since then, or since the last
    attempt of a fix."""
    counts: Ints
    """(3, S, slots of a second) ranges received, rejected, and rejected because they are late, in a ring."""
    accepted: Ints
    """(S, J) slot of the last accepted range of each emitter."""
    report: Floats
    """(S, 4) quality, standard deviation of the position [m], ranges received and rejected in the last cycle."""
    nis: Floats
    """(S, 2) sum of normalised squared innovations of accepted ranges since the fix, and their number."""
    acquisition: AcquisitionState


class Workspace(NamedTuple):
    """Memory for one slot of one station."""

    transition: Floats
    """(9, 9) of the slot, see `strapdown.add_tick`."""
    product: Floats
    """(9, 15) for `strapdown.propagate_covariance`."""
    vectors: Floats
    """(4, 15) error, slope, column and rest, see `strapdown.joseph_update`."""
    angles: Floats
    """(5, 3) corrected turns between the slot's ticks [rad]."""
    force: Floats
    """(3,) the slot's mean specific force in the tracker's axes [m/s^2]."""


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
def range_variance(
    model: RangingModel, emitter: int, distance_m: float, x: float, y: float, z: float, cos_station: float
) -> float:
    """Variance of a range [m^2] at a distance, in the direction (x, y, z) from the emitter to the microphone.

    `cos_station` is the cosine of the angle between the station's z axis and the direction to the emitter.
    """
    normal = model.normal[emitter]
    cos_emitter = normal[0] * x + normal[1] * y + normal[2] * z
    level = level_db(distance_m, cos_emitter, cos_station, model.absorption_db_per_m)
    noise = model.range_noise_m * noise_factor(level, model.absorption_db_per_m)
    return noise * noise + (model.range_scale * distance_m) ** 2 + model.survey_m**2
