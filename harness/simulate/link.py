"""Timing of the tracker and its serial line: when stations are sampled and when records arrive."""

from collections import deque
from dataclasses import asdict, dataclass
from typing import Annotated, Any

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.ranges import Range, check_fields
from harness.errors import BadInput
from harness.stream.polhemus.codec import BITS_PER_BYTE, STANDARD_LIST, record_size


@dataclass(frozen=True)
class TrackerConfig:
    """Rates, latency, line and output list of a simulated IS-900."""

    rate_hz: Annotated[float, Range(1.0, 1000.0)] = 40.0
    """Records per second of each station (Liu et al. 2011)."""
    latency_s: Annotated[float, Range(0.0, 60.0)] = 0.004
    """Delay from the sample to the first bit on a free line [s] (docs/is900.md 13.1, unverified)."""
    baud: Annotated[int, Range(1, 100_000_000)] = 115200
    """Bits per second of the line (docs/is900.md 2)."""
    slot_s: Annotated[float | None, Range(0.0, 1.0)] = None
    """Time between the samples of one station and the next [s]; by default as fast as the line takes records."""
    items: Annotated[tuple[int, ...], Range(0, 255)] = STANDARD_LIST
    """Output list (item numbers) of every station."""
    queue_records: Annotated[int, Range(1, 1_000_000)] = 12
    """Length of the send queue; when it is full the oldest record is dropped (docs/is900.md 14) [choice]."""
    origin_m: Annotated[tuple[float, float, float], Range(-100.0, 100.0)] = (0.0, 0.0, 2.5)
    """Origin of the tracker's frame in the world [m]; the default is under the ceiling."""
    overload: bool = False
    """The line may drop any share of the records, because a slow line is what the scenario studies. Without it nothing
    is measured where less than `core.stream_health.LEAST_ARRIVED` of them arrive."""

    def __post_init__(self) -> None:
        check_fields(self)
        if 21 not in self.items:
            raise BadInput("The output list has no item 21 (time).", "Frames are matched with the truth by it: add it.")

    def as_dict(self) -> dict[str, Any]:
        """The fields, without an overload that is not allowed, as before the key existed."""
        content = asdict(self)
        if not self.overload:
            del content["overload"]
        return content

    @property
    def record_s(self) -> float:
        """Transmission time of one record [s]."""
        return record_size(self.items) * BITS_PER_BYTE / self.baud

    def station_slot_s(self, stations: int) -> float:
        """Time between the samples of one station and the next [s]; BadInput if they do not fit into a period."""
        if self.slot_s is None:
            return min(self.record_s, 1.0 / (self.rate_hz * stations))
        if not 0.0 <= self.slot_s * stations <= (1.0 + 1e-9) / self.rate_hz:
            raise BadInput(
                f"{stations} stations {1e3 * self.slot_s:g} ms apart do not fit into a period of "
                f"{1e3 / self.rate_hz:g} ms.",
                "Choose a shorter slot_s or a lower rate_hz.",
            )
        return self.slot_s


def transmit(ready_s: Floats, tracker: TrackerConfig) -> tuple[Bools, Floats]:
    """Transmit N records that are ready at these times, in order: which get through, and their arrival times [s].

    One record at a time is on the line. A record that finds the queue full displaces the oldest waiting one.
    """
    busy_s = tracker.record_s
    at: Floats = busy_s * np.arange(len(ready_s), dtype=float)
    start_s: Floats = at + np.maximum.accumulate(ready_s - at)
    if np.all(start_s - ready_s <= (tracker.queue_records - 1) * busy_s):
        return np.ones(len(ready_s), bool), start_s + busy_s
    return _transmit_overloaded(ready_s, tracker)


def _transmit_overloaded(ready_s: Floats, tracker: TrackerConfig) -> tuple[Bools, Floats]:
    """`transmit` for a line that cannot keep up, record by record."""
    sent, arrived_s = np.zeros(len(ready_s), bool), np.full(len(ready_s), np.nan)
    waiting: deque[int] = deque()
    free_s = 0.0

    def send_until(now_s: float) -> None:
        nonlocal free_s
        while waiting and max(free_s, float(ready_s[waiting[0]])) < now_s:
            record = waiting.popleft()
            free_s = max(free_s, float(ready_s[record])) + tracker.record_s
            sent[record], arrived_s[record] = True, free_s

    for record, now_s in enumerate(ready_s.tolist()):
        send_until(now_s)
        if len(waiting) == tracker.queue_records:
            waiting.popleft()
        waiting.append(record)
    send_until(np.inf)
    return sent, arrived_s
