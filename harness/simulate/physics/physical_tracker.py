"""A physical tracker: from the true motion of stations to what the device's filter reports of each.

A take is simulated in blocks of slots, so that memory does not grow with the rate of the inertial sensors. Every part
carries its state from block to block, and results do not depend on the size of the blocks.
"""

import math
from typing import Protocol

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.stream_health import ENOUGH_EMITTERS
from harness.simulate.physics.constellation import Constellation
from harness.simulate.physics.filter_readings import FilterReadings, empty_readings
from harness.simulate.physics.filter_state import Outputs
from harness.simulate.physics.fusion import FusionFilter, empty_outputs
from harness.simulate.physics.inertial import InertialUnit, true_increments
from harness.simulate.physics.motion import TrackerMotion, TrackerMotionSource
from harness.simulate.physics.ranging import Ranges, Ranging
from harness.simulate.physics.room import PlacedRoom
from harness.simulate.physics.schedule import TICKS_PER_SLOT, Schedule
from harness.simulate.physics.settings import Physics
from harness.simulate.physics.sight import Sight

BLOCK_SLOTS = 160
"""Slots of a block: two seconds."""


class RangeSource(Protocol):
    """What measures the ranges of block after block of slots; see `Ranging`."""

    def measure(self, first_slot: int, motion: TrackerMotion, qpos: Floats | None) -> Ranges: ...


class PhysicalTracker:
    """A device with S stations that are worn in a room. It measures one take, from its lead-in to the last record."""

    def __init__(
        self,
        source: TrackerMotionSource,
        physics: Physics,
        constellation: Constellation,
        placed: PlacedRoom,
        sight: Sight | None,
        *,
        seed: int,
        take: str,
        session: str = "",
    ) -> None:
        """`constellation` is the one that the device knows; the true one differs by the survey's errors.

        `seed`, `take` and `session` key the random draws.
        """
        stations, inertial = source.stations, physics.inertial
        self.schedule = Schedule(inertial.rate_hz, len(constellation))
        true = constellation.surveyed(physics.constellation.survey_sd_m, seed, session or take)
        self.ranging: RangeSource = Ranging(
            physics.sound, true, self.schedule, placed, sight, stations, seed=seed, take=take, session=session
        )
        self.unit = InertialUnit(inertial, stations, seed=seed, take=take, session=session)
        self.fusion = FusionFilter(
            physics.fusion,
            physics.sound,
            inertial,
            constellation.position_m,
            constellation.normal,
            self.schedule,
            stations,
        )
        self._source, self._lever_m = source, np.array(inertial.lever_m)
        self._first_slot = -lead_in_slots(physics)
        self._with_body = sight is not None

    def measure(self, time_s: Floats, *, with_motion: bool = False) -> FilterReadings:
        """Readings at the times (E, S) of a take, ascending for each station and not before 0 [s].

        `with_motion` also keeps what prediction and enhancement need.
        """
        tick_hz = self.schedule.tick_hz
        tick = np.floor(time_s * tick_hz).astype(np.int64)
        last_slot = int(tick.max()) // TICKS_PER_SLOT
        out = empty_readings(time_s.shape, with_motion)
        hearing = _Hearing(self.schedule.emitters, time_s.shape[1])
        first = self._first_slot
        while first <= last_slot:
            slots = min(BLOCK_SLOTS, last_slot + 1 - first)
            motion, ranges = self._advance_true(first, slots)
            angle_rad, velocity_m_s = self.unit.measure(*true_increments(motion, self._lever_m))
            begin, end = first * TICKS_PER_SLOT, (first + slots) * TICKS_PER_SLOT
            within = (tick >= begin) & (tick < end)
            rows = np.nonzero(within.any(axis=1))[0]
            some = slice(int(rows[0]), int(rows[-1]) + 1) if len(rows) else slice(0, 0)
            outputs = empty_outputs(tick[some], time_s[some] * tick_hz - tick[some])
            self.fusion.advance(first, angle_rad, velocity_m_s, ranges.range_m, outputs)
            _store(out, outputs, some, within[some])
            hearing.add(first, ranges)
            first += slots
        out.hearing_share, out.echo_share = hearing.shares()
        return out

    def _advance_true(self, first: int, slots: int) -> tuple[TrackerMotion, Ranges]:
        """True motion and ranges of a block."""
        ticks_s = self.schedule.ticks_s(first, slots)
        motion = self._source.advance(ticks_s)
        qpos = self._source.qpos(ticks_s[:-1:TICKS_PER_SLOT]) if self._with_body else None
        return motion, self.ranging.measure(first, motion, qpos)


def lead_in_slots(physics: Physics) -> int:
    """Slots that the device runs before a take."""
    return math.ceil(physics.fusion.warm_up_s * physics.inertial.rate_hz / TICKS_PER_SLOT)


def lead_in_s(physics: Physics) -> float:
    """Time that the device runs before a take: `fusion.warm_up_s` in whole slots [s]."""
    return lead_in_slots(physics) * TICKS_PER_SLOT / physics.inertial.rate_hz


class _Hearing:
    """Counts how many emitters each station hears directly, and how many ranges are echoes, from time 0 on."""

    def __init__(self, emitters: int, stations: int) -> None:
        self._last = np.full((stations, emitters), -(2**62))
        self._enough, self._slots = np.zeros(stations), 0
        self._ranges, self._echoes = np.zeros(stations), np.zeros(stations)

    def add(self, first_slot: int, ranges: Ranges) -> None:
        heard: Bools = np.any(ranges.direct, axis=2)
        emitters = self._last.shape[1]
        for k, emitter in enumerate(ranges.emitter.tolist()):
            self._last[heard[k], emitter] = first_slot + k
            if first_slot + k >= 0:
                self._enough += np.sum(self._last > first_slot + k - emitters, axis=1) >= ENOUGH_EMITTERS
                self._slots += 1
        taken = slice(max(-first_slot, 0), None)
        self._ranges += np.sum(~np.isnan(ranges.range_m[taken]), axis=(0, 2))
        self._echoes += np.sum(ranges.echo[taken], axis=(0, 2))

    def shares(self) -> tuple[Floats, Floats]:
        return self._enough / max(self._slots, 1), self._echoes / np.maximum(self._ranges, 1.0)


def _store(out: FilterReadings, outputs: Outputs, some: slice, within: Bools) -> None:
    """Copy the outputs of the rows `some` whose ticks lie in the block."""
    out.position_m[some][within] = outputs.position_m[:, :, 0][within]
    out.tracker_from_station[some][within] = outputs.tracker_from_station[:, :, 0][within]
    quality, _, received, rejected = np.moveaxis(outputs.report, -1, 0)
    out.quality[some][within] = quality[within]
    out.ranges_received[some][within] = received[within]
    out.ranges_rejected[some][within] = rejected[within]
    if out.motion is not None:
        out.motion.velocity_m_s[some][within] = outputs.velocity_m_s[within]
        out.motion.turn_rad_s[some][within] = outputs.turn_rad_s[within]
        for mode in range(2):
            out.motion.enhanced_position_m[mode, some][within] = outputs.position_m[:, :, 1 + mode][within]
            turned = outputs.tracker_from_station[:, :, 1 + mode]
            out.motion.enhanced_tracker_from_station[mode, some][within] = turned[within]
