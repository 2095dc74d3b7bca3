"""A physical tracker: from the true motion of stations to what the device's filter reports of each.

The modules follow the signal: `schedule` and `constellation` say which emitter fires, `ranging` what is heard of it,
`inertial` what the sensors measure, `fusion` and `filter` what the device computes, `tracking_status` whether it is
trusted. A take is simulated in blocks of slots, so that memory does not grow with the rate of the inertial sensors.
Every part carries its state from block to block, and results do not depend on the size of the blocks.
"""

import math
from typing import ClassVar, Protocol

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.seeds import generator
from harness.core.stream_health import ENOUGH_EMITTERS
from harness.simulate.physics.constellation import Constellation
from harness.simulate.physics.fusion import FusionFilter, empty_outputs
from harness.simulate.physics.inertial import InertialUnit, true_increments
from harness.simulate.physics.line_of_sight import LineOfSight
from harness.simulate.physics.motion import TrackerMotion, TrackerMotionSource
from harness.simulate.physics.ranging import Ranges, Ranging
from harness.simulate.physics.room import PlacedRoom
from harness.simulate.physics.schedule import TICKS_PER_SLOT, FiringOrder, Schedule
from harness.simulate.physics.settings import Physics
from harness.simulate.readings import FilterReadings


class RangeSource(Protocol):
    """What measures the ranges of block after block of slots; see `Ranging`."""

    def measure_ranges(self, first_slot: int, emitter: Ints, motion: TrackerMotion, qpos: Floats | None) -> Ranges: ...


class PhysicalTracker:
    """A device with S stations that are worn in a room. It measures one take, from its lead-in to the last record."""

    block_slots: ClassVar[int] = 160
    """Slots that are simulated at once: two seconds. The bytes do not depend on it."""

    def __init__(
        self,
        source: TrackerMotionSource,
        physics: Physics,
        constellation: Constellation,
        placed: PlacedRoom,
        sight: LineOfSight | None,
        *,
        seed: int,
        take: str,
        session: str = "",
    ) -> None:
        """`constellation` is the one that the device knows; the true one differs by the survey's errors.

        `seed`, `take` and `session` key the random draws.
        """
        stations, sound, inertial = source.stations, physics.sound, physics.inertial
        self.schedule = Schedule(inertial.rate_hz, len(constellation))
        true = constellation.with_survey_error(physics.constellation.survey_sd_m, seed, session or take)
        self.ranging: RangeSource = Ranging(
            sound, true, self.schedule, placed, sight, stations, seed=seed, take=take, session=session
        )
        rngs = [generator(seed, "physics", session or take, "microphones", station) for station in stations]
        microphone_m = np.array([rng.normal(sound.microphones_m, sound.microphone_sd_m) for rng in rngs])
        self.unit = InertialUnit(inertial, stations, seed=seed, take=take, session=session)
        self.fusion = FusionFilter(
            physics.fusion, sound, inertial, constellation, microphone_m, self.schedule, stations
        )
        self._source, self._lever_m = source, np.array(inertial.lever_m)
        self._first_slot = -lead_in_slots(physics)
        self._emitter_m, self._with_body = constellation.position_m, sight is not None

    def measure_take(self, time_s: Floats) -> FilterReadings:
        """Readings at the times (E, S) of a take, ascending for each station and not before 0 [s]."""
        tick, fraction = self.schedule.ticks_at(time_s)
        outputs = empty_outputs(tick, fraction)
        statistics = _RangeStatistics(self.schedule, time_s.shape[1])
        firing = FiringOrder(self._emitter_m, self.schedule.turn_slots, self._first_slot)
        end = int(tick.max()) // TICKS_PER_SLOT + 1
        for first in range(self._first_slot, end, self.block_slots):
            ticks_s = self.schedule.ticks_s(first, min(self.block_slots, end - first))
            slots_s = ticks_s[:-1:TICKS_PER_SLOT]
            motion = self._source.sample_motion(ticks_s)
            emitter = firing.next_emitters(self._source.performer_m(slots_s))
            qpos = self._source.qpos(slots_s) if self._with_body else None
            ranges = self.ranging.measure_ranges(first, emitter, motion, qpos)
            angle_rad, velocity_m_s = self.unit.measure_increments(*true_increments(motion, self._lever_m))
            self.fusion.filter_block(first, emitter, angle_rad, velocity_m_s, ranges.range_m, outputs)
            statistics.add(first, ranges)
        quality, _, received, rejected = np.moveaxis(outputs.report, -1, 0)
        position_m, turned = (
            np.ascontiguousarray(np.moveaxis(modes, 2, 0))
            for modes in (outputs.position_m, outputs.tracker_from_station)
        )
        return FilterReadings(
            *(position_m[0], turned[0], np.ascontiguousarray(quality)),
            *(received.astype(np.int64), rejected.astype(np.int64)),
            *(outputs.velocity_m_s, outputs.turn_rad_s, position_m[1:], turned[1:]),
            *statistics.shares(),
        )


def lead_in_slots(physics: Physics) -> int:
    """Slots that the device runs before a take."""
    return math.ceil(physics.fusion.warm_up_s * physics.inertial.rate_hz / TICKS_PER_SLOT)


def lead_in_s(physics: Physics) -> float:
    """Time that the device runs before a take: `fusion.warm_up_s` in whole slots [s]."""
    return lead_in_slots(physics) * TICKS_PER_SLOT / physics.inertial.rate_hz


class _RangeStatistics:
    """Counts how many emitters each station hears directly, and how many ranges are echoes, from time 0 on."""

    def __init__(self, schedule: Schedule, stations: int) -> None:
        self._last, self._turn = np.full((stations, schedule.emitters), -(2**62)), schedule.turn_slots
        self._enough, self._slots = np.zeros(stations), 0
        self._ranges, self._echoes = np.zeros(stations), np.zeros(stations)

    def add(self, first_slot: int, ranges: Ranges) -> None:
        heard: Bools = np.any(ranges.direct, axis=2)
        for k, emitter in enumerate(ranges.emitter.tolist()):
            self._last[heard[k], emitter] = first_slot + k
            if first_slot + k >= 0:
                self._enough += np.sum(self._last > first_slot + k - self._turn, axis=1) >= ENOUGH_EMITTERS
                self._slots += 1
        taken = slice(max(-first_slot, 0), None)
        self._ranges += np.sum(~np.isnan(ranges.range_m[taken]), axis=(0, 2))
        self._echoes += np.sum(ranges.echo[taken], axis=(0, 2))

    def shares(self) -> tuple[Floats, Floats]:
        return self._enough / max(self._slots, 1), self._echoes / np.maximum(self._ranges, 1.0)
