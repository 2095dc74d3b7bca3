"""Timing of the simulated device: ticks of the inertial sensors, and the emitter that fires in each slot.

Time is counted in ticks of the inertial sensors from a take's beginning, and is negative before it. A slot is a fixed
number of ticks. One emitter fires at the beginning of each slot, which every station hears, and what arrives until the
slot's end belongs to it. No part of the timing depends on which stations are worn.
"""

from typing import NamedTuple

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.core.compiled import compiled

TICKS_PER_SLOT = 5
"""At 400 ticks per second a slot takes 12.5 ms, in which sound travels 4.3 m [choice]."""
NEAR_EMITTERS = 9
"""Number of emitters near the performer that fire, if there are as many [choice]."""
_TICK_DECIMALS = 8
"""Times that differ by less than this part of a tick are one: the rounding of 64-bit numbers does not move a record
over a slot's edge."""


class Schedule(NamedTuple):
    """The slots of J emitters at a rate of the inertial sensors."""

    tick_hz: float
    """Ticks per second."""
    emitters: int
    """Number of emitters, J."""

    @property
    def slot_s(self) -> float:
        """Duration of a slot [s]."""
        return TICKS_PER_SLOT / self.tick_hz

    @property
    def turn_slots(self) -> int:
        """Slots in which each emitter near a performer who stands has fired once."""
        return min(self.emitters, NEAR_EMITTERS)

    def ticks_s(self, first_slot: int, slots: int) -> Floats:
        """Times of the ticks of a block of slots, with the tick that ends it: (5 * slots + 1,) [s]."""
        first = first_slot * TICKS_PER_SLOT
        out: Floats = np.arange(first, first + slots * TICKS_PER_SLOT + 1) / self.tick_hz
        return out

    def ticks_at(self, time_s: Floats) -> tuple[Ints, Floats]:
        """The last tick before each time (...) [s], and the part of a tick that has passed since, in 0..1."""
        ticks = np.round(time_s * self.tick_hz, _TICK_DECIMALS)
        whole = np.floor(ticks)
        return whole.astype(np.int64), ticks - whole


class FiringOrder:
    """Which of J emitters (J, 3) fires in each slot: of those nearest to the performer, the one silent for longest.

    `near` emitters, at most J, count as nearest; if they are all J, they fire in a fixed turn. The order takes block
    after block of slots, from `first_slot` on.
    """

    def __init__(self, emitter_m: Floats, near: int, first_slot: int) -> None:
        self._emitter_m, self._near = np.array(emitter_m, dtype=float), near
        self._slot, count = first_slot, len(emitter_m)
        # As if they had fired in turn before.
        self._last = first_slot - 1 - (first_slot - 1 - np.arange(count)) % count

    def next_emitters(self, performer_m: Floats) -> Ints:
        """(F,) index of the emitter that fires in each of the next F slots.

        `performer_m` (F, 3) is the performer's place at the beginning of each slot, in the tracker's frame [m].
        """
        out = np.empty(len(performer_m), dtype=np.int64)
        _fire(self._emitter_m, self._near, np.ascontiguousarray(performer_m), self._slot, self._last, out)
        self._slot += len(out)
        return out


@compiled
def _fire(emitter_m: Floats, near: int, performer_m: Floats, first_slot: int, last: Ints, out: Ints) -> None:
    """Set the emitter of each slot (F,), and the slot in which each emitter fired last (J,)."""
    away_m2 = np.empty(len(emitter_m))
    for f in range(len(out)):
        for j in range(len(emitter_m)):
            away_m2[j] = 0.0
            for i in range(3):
                away_m2[j] += (emitter_m[j, i] - performer_m[f, i]) ** 2
        nearest = np.argsort(away_m2, kind="mergesort")[:near]
        chosen = nearest[np.argmin(last[nearest])]
        last[chosen] = first_slot + f
        out[f] = chosen
