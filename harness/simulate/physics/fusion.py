"""Fusion of inertia and ranges: the error-state filter of a station.

The filter sees what a device would: increments of angle and velocity, ranges, and the emitters as surveyed. It starts
from a fix, never from the truth.
"""

import math
from collections.abc import Sequence

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.errors import ShapeError
from harness.simulate.physics.acquisition import (
    FIRST_TILT_VARIANCE,
    LEAST_WINDOW_SLOTS,
    LONGEST_WINDOW_SLOTS,
    RANGE_FIELDS,
)
from harness.simulate.physics.constellation import Constellation
from harness.simulate.physics.filter import filter_stations
from harness.simulate.physics.filter_record import MODES
from harness.simulate.physics.filter_settings import Fusion
from harness.simulate.physics.filter_state import AcquisitionState, FilterModel, FilterState, Outputs, RangingModel
from harness.simulate.physics.inertial import Inertial
from harness.simulate.physics.schedule import TICKS_PER_SLOT, Schedule
from harness.simulate.physics.sound import MICROPHONES, Sound, speed_of_sound_m_s, threshold_db
from harness.simulate.physics.strapdown import ERRORS, STATE
from harness.simulate.physics.tracking_status import CONFIRMATION_SLOTS, freeze_position, set_bias_covariance


class FusionFilter:
    """The filters of S stations, which advance over blocks of slots; results do not depend on the blocks' size.

    A station's results depend on its own measurements alone, and not on how many others there are.
    """

    def __init__(
        self,
        fusion: Fusion,
        sound: Sound,
        inertial: Inertial,
        constellation: Constellation,
        microphone_m: Floats,
        schedule: Schedule,
        stations: Sequence[str],
    ) -> None:
        """What the device knows: the constellation in the tracker's frame, and the microphones (S, 2, 3) of each
        station in its axes [m].
        """
        lever = np.array(inertial.lever_m)
        slot_s, turn = schedule.slot_s, schedule.turn_slots
        window = min(max(3 * turn, LEAST_WINDOW_SLOTS), LONGEST_WINDOW_SLOTS)
        second = max(round(1.0 / slot_s), 1)
        self.stations = tuple(stations)
        ranging = RangingModel(
            np.array(constellation.position_m),
            np.array(constellation.normal),
            np.array(microphone_m) - lever,
            speed_of_sound_m_s(sound.assumed_c),
            sound.absorption_db_per_m,
            fusion.range_noise_m,
            fusion.range_scale,
            fusion.survey_m,
            constellation.range_m,
            math.cos(constellation.cone_rad),
            threshold_db(constellation.range_m, constellation.cone_rad, sound.absorption_db_per_m),
        )
        sensors, models = (inertial.gyroscope, inertial.accelerometer), (fusion.gyroscope, fusion.accelerometer)
        self.model = FilterModel(
            ranging=ranging,
            tick_s=1.0 / schedule.tick_hz,
            lever_m=lever,
            gate=fusion.gate,
            noise=np.square([*(model.noise for model in models), *(model.bias_walk for model in models)]),
            bias_variance=np.square([model.bias for model in models]),
            inertial_scale=fusion.inertial_scale,
            limit=np.array([errors.limit for errors in sensors]),
            sigma_limit_m=fusion.sigma_limit_m,
            reject_share=fusion.reject_share,
            coast_slots=int(fusion.coast_s / slot_s),
            reject_slots=second,
            confirmation_slots=min(max(turn, CONFIRMATION_SLOTS), LONGEST_WINDOW_SLOTS),
            window_s=(window + 0.5) * slot_s,
            best_sigma_m=fusion.quality_sigma_m,
        )
        self.state = _initial_state(
            len(self.stations), len(constellation), max(second, LEAST_WINDOW_SLOTS), MICROPHONES * (window + 1)
        )
        for s in range(len(self.stations)):
            set_bias_covariance(self.model, self.state.covariance[s])
            freeze_position(self.state, s)

    def filter_block(
        self,
        first_slot: int,
        emitter: Ints,
        angle_rad: Floats,
        velocity_m_s: Floats,
        range_m: Floats,
        outputs: Outputs,
    ) -> None:
        """Advance over F slots, and fill those outputs whose ticks lie in them; the others stay as they are.

        `emitter` (F,) fires in each slot; `range_m` (F, S, 2) is NaN where it was not heard. `angle_rad` and
        `velocity_m_s` (5 F, S, 3) are increments, see `strapdown`. A record shows what the filter knows at the
        beginning of its slot, and the inertia since.
        """
        slots, count = len(emitter), len(self.stations)
        for name, array, shape in (
            ("angle_rad", angle_rad, (TICKS_PER_SLOT * slots, count, 3)),
            ("velocity_m_s", velocity_m_s, (TICKS_PER_SLOT * slots, count, 3)),
            ("range_m", range_m, (slots, count, MICROPHONES)),
        ):
            if array.shape != shape:
                raise ShapeError("FusionFilter", name, array.shape, str(shape))
        angle, velocity, ranges = (np.ascontiguousarray(a, dtype=float) for a in (angle_rad, velocity_m_s, range_m))
        filter_stations(self.model, self.state, first_slot, emitter, angle, velocity, ranges, outputs)


def empty_outputs(tick: Ints, fraction: Floats) -> Outputs:
    """Outputs of records at ticks (E, S) and parts of a tick (E, S), to be filled by `FusionFilter.filter_block`."""
    shape = tick.shape
    return Outputs(
        np.ascontiguousarray(tick, dtype=np.int64),
        np.ascontiguousarray(fraction, dtype=float),
        np.full((*shape, MODES, 3), np.nan),
        np.full((*shape, MODES, 4), np.nan),
        np.full((*shape, 3), np.nan),
        np.full((*shape, 3), np.nan),
        np.full((*shape, 4), np.nan),
    )


def _initial_state(stations: int, emitters: int, slots: int, ranges: int) -> FilterState:
    motion = np.zeros((stations, TICKS_PER_SLOT + 1, STATE))
    motion[:, :, 6] = 1.0
    return FilterState(
        motion=motion,
        bias=np.zeros((stations, 6)),
        covariance=np.zeros((stations, ERRORS, ERRORS)),
        turn_rad_s=np.zeros((stations, 3)),
        acceleration_m_s2=np.zeros((stations, 3)),
        offset=np.zeros((stations, MODES - 1, 6)),
        status=np.zeros((stations, 6), dtype=np.int64),
        counts=np.zeros((3, stations, slots), dtype=np.int64),
        accepted=np.full((stations, emitters), -(2**62)),
        report=np.zeros((stations, 4)),
        nis=np.zeros((stations, 2)),
        acquisition=AcquisitionState(
            ranges=np.zeros((stations, ranges, RANGE_FIELDS)),
            range_count=np.zeros(stations, dtype=np.int64),
            path=np.zeros((stations, 7)),
            gravity=np.zeros((stations, 5)),
            tilt_variance=np.full(stations, FIRST_TILT_VARIANCE),
        ),
    )
