"""The serial line between tracker and host: when each record arrives, and what it cannot carry.

8N1 takes ten bits a byte (docs/is900.md section 10). What a real tracker does when the line cannot keep up is not
documented; here whole records are dropped, oldest first, and counted (section 14).
"""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats

BITS_PER_BYTE = 10


@dataclass(frozen=True, eq=False)
class Carried:
    """What became of N records."""

    arrived_s: Floats
    """(N,) host time at which the last byte was in [s]; NaN where dropped."""

    @property
    def sent(self) -> Bools:
        """(N,)"""
        out: Bools = ~np.isnan(self.arrived_s)
        return out


def carry(ready_s: Floats, record_bytes: int, baud: float, longest_queue: int) -> Carried:
    """Send records (N,) that are ready at these times, in order; at most `longest_queue` wait at any moment."""
    takes_s = record_bytes * BITS_PER_BYTE / baud
    k = np.arange(len(ready_s))
    ended_s = np.maximum.accumulate(ready_s - k * takes_s) + (k + 1) * takes_s
    waited = ended_s - ready_s
    if not len(ready_s) or waited.max() <= longest_queue * takes_s:
        return Carried(ended_s)
    return Carried(_with_a_full_queue(ready_s, takes_s, longest_queue))


def _with_a_full_queue(ready_s: Floats, takes_s: float, longest_queue: int) -> Floats:
    arrived_s = np.full(len(ready_s), np.nan)
    queue: list[int] = []
    free_s = -np.inf
    for k, now_s in enumerate(ready_s):
        while queue and max(free_s, ready_s[queue[0]]) < now_s:
            first = queue.pop(0)
            free_s = max(free_s, ready_s[first]) + takes_s
            arrived_s[first] = free_s
        queue.append(k)
        if len(queue) > longest_queue:
            queue.pop(0)
    for k in queue:
        free_s = max(free_s, ready_s[k]) + takes_s
        arrived_s[k] = free_s
    return arrived_s
