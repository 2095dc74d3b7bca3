"""Timing of the simulated device: ticks of the inertial sensors, and the emitter that fires in each slot.

Time is counted in ticks of the inertial sensors from a take's beginning, and is negative before it. A slot is a fixed
number of ticks. One emitter fires at the beginning of each slot, in a fixed turn that every station hears, and what
arrives until the slot's end belongs to it. So no part of the timing depends on which stations are worn.
"""

from typing import NamedTuple

import numpy as np

from harness.core.arrays import Floats, Ints

TICKS_PER_SLOT = 5
"""At 400 ticks per second a slot takes 12.5 ms, in which sound travels 4.3 m [choice]."""


class Schedule(NamedTuple):
    """The turn of J emitters at a rate of the inertial sensors."""

    tick_hz: float
    """Ticks per second."""
    emitters: int
    """Number of emitters, J."""

    @property
    def slot_s(self) -> float:
        """Duration of a slot [s]."""
        return TICKS_PER_SLOT / self.tick_hz

    def ticks_s(self, first_slot: int, slots: int) -> Floats:
        """Times of the ticks of a block of slots, with the tick that ends it: (5 * slots + 1,) [s]."""
        first = first_slot * TICKS_PER_SLOT
        out: Floats = np.arange(first, first + slots * TICKS_PER_SLOT + 1) / self.tick_hz
        return out

    def emitter_of(self, first_slot: int, slots: int) -> Ints:
        """(slots,) index of the emitter that fires at the beginning of each slot."""
        out: Ints = np.arange(first_slot, first_slot + slots) % self.emitters
        return out
