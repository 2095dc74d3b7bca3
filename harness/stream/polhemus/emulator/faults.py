"""Injected faults: a scenario's `[[fault]]` tables, and when each occurs.

Each fault draws from its own random generator. The same seed therefore gives the same faults to the same messages, and
an additional fault leaves the others unchanged.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, get_args

import numpy as np

from harness.core.ranges import Range, check_fields
from harness.core.seeds import generator
from harness.errors import BadInput
from harness.stream.polhemus.codec.reader import ByteCapture

ByteFaultKind = Literal["lost", "garbled", "duplicated", "added", "repeated"]
FaultEpisodeKind = Literal["burst", "stall", "disconnect", "reset", "lost_station"]
FaultKind = Literal[ByteFaultKind, FaultEpisodeKind, "firmware"]
BYTE_FAULT_KINDS: tuple[str, ...] = get_args(ByteFaultKind)
FAULT_EPISODE_KINDS: tuple[str, ...] = get_args(FaultEpisodeKind)
_INSTANT_KINDS = (*BYTE_FAULT_KINDS, "reset")
_FIRMWARE = re.compile(r"\d\.\d{2,4}")


def check_firmware(version: str) -> None:
    """Raise BadInput unless this is a version of the form that the status record reports."""
    if not _FIRMWARE.fullmatch(version):
        raise BadInput(
            f"firmware {version!r}.", "Give a version such as 4.2301: one digit, a point, two to four digits."
        )


@dataclass(frozen=True)
class Fault:
    """One kind of fault, and when it occurs. Raises BadInput where it is contradictory.

    - `lost`, `garbled`, `duplicated`, `added`: one byte of a record or reply is affected.
    - `repeated`: a record or reply is sent twice.
    - `burst`: every byte is random for a while.
    - `stall`: the line sends nothing, and what it has no room for is dropped.
    - `disconnect`: the line is unplugged.
    - `reset`: the device's power is cut for a moment.
    - `lost_station`: a station is out of sight.
    - `firmware`: the device has another firmware version.
    """

    kind: FaultKind
    share: Annotated[float, Range(0.0, 1.0)] = 0.0
    """Share of the records and replies in which a byte is lost, changed, doubled or added, or that are sent twice."""
    at_s: Annotated[tuple[float, ...], Range(0.0, 1e6)] = ()
    """Times after power-on [s]."""
    per_minute: Annotated[float, Range(0.0, 6e4)] = 0.0
    """Mean number of additional random occurrences per minute."""
    lasts_s: Annotated[float, Range(0.0, 1e6)] = 0.0
    """Duration of a burst, stall, disconnection or loss of sight [s]."""
    station: str = ""
    """Name of the station that is out of sight; "" is the first."""
    firmware: str = ""
    """Firmware version, such as 4.1105, which has no item 40."""

    def __post_init__(self) -> None:
        keys = {
            "share": (self.share != 0.0, self.kind in BYTE_FAULT_KINDS),
            "at_s and per_minute": (bool(self.at_s) or self.per_minute != 0.0, self.kind != "firmware"),
            "lasts_s": (self.lasts_s != 0.0, self.kind not in (*_INSTANT_KINDS, "firmware")),
            "station": (bool(self.station), self.kind == "lost_station"),
            "firmware": (bool(self.firmware), self.kind == "firmware"),
        }
        for name, (is_set, allowed) in keys.items():
            if is_set and not allowed:
                raise BadInput(f"fault {self.kind!r} has no {name}.", "Omit it.")
        check_fields(self)
        if self.kind in FAULT_EPISODE_KINDS and self.kind not in _INSTANT_KINDS and self.lasts_s == 0.0:
            raise BadInput(f"fault {self.kind!r} has no duration.", "Give lasts_s.")
        if not (self.share or self.at_s or self.per_minute or self.firmware):
            raise BadInput(f"fault {self.kind!r} never happens.", "Give share, at_s, per_minute or firmware.")
        if self.kind == "firmware":
            check_firmware(self.firmware)


@dataclass(frozen=True, slots=True)
class FaultEpisode:
    """A period in which a fault is active."""

    fault: Fault
    from_s: float
    to_s: float


class FaultInjector:
    """All faults of a scenario from power-on. Calls must have increasing times."""

    def __init__(self, faults: Iterable[Fault], seed: int, start_s: float) -> None:
        self._byte_faults: list[tuple[Fault, np.random.Generator, _FaultSchedule]] = []
        self._episode_schedules: list[_FaultSchedule] = []
        for number, fault in enumerate(faults):
            schedule = _FaultSchedule(fault, generator(seed, "fault", number, fault.kind, "when"), start_s)
            draws = generator(seed, "fault", number, fault.kind, "what")
            if fault.kind in BYTE_FAULT_KINDS:
                self._byte_faults.append((fault, draws, schedule))
            elif fault.kind in FAULT_EPISODE_KINDS:
                self._episode_schedules.append(schedule)
        self._noise = generator(seed, "fault", "burst")

    @property
    def next_s(self) -> float:
        """When the next episode begins [s]."""
        return min((schedule.next_s for schedule in self._episode_schedules), default=float("inf"))

    def pop_started(self, now_s: float) -> list[FaultEpisode]:
        """Return the episodes that have begun since the last call, in sequence."""
        episodes: list[FaultEpisode] = []
        for schedule in self._episode_schedules:
            episodes += [
                FaultEpisode(schedule.fault, at_s, at_s + schedule.fault.lasts_s) for at_s in schedule.until(now_s)
            ]
        return sorted(episodes, key=lambda episode: episode.from_s)

    def corrupt(self, data: bytes, bursting: bool, due_s: float) -> tuple[bytes, tuple[str, ...]]:
        """Return a message that is due at `due_s` with its faults, and the kinds of those faults."""
        kinds: list[str] = []
        for fault, draws, schedule in self._byte_faults:
            hit = bool(fault.share) and draws.random() < fault.share
            if hit or schedule.until(due_s):
                at, value = int(draws.integers(len(data))), bytes([int(draws.integers(1, 256))])
                data = _corrupt(fault.kind, data, at, value)
                kinds.append(fault.kind)
        if bursting:
            data = self._noise.bytes(len(data))
            kinds.append("burst")
        return data, tuple(kinds)


def _corrupt(kind: str, data: bytes, at: int, value: bytes) -> bytes:
    head, byte_at, tail = data[:at], data[at : at + 1], data[at + 1 :]
    match kind:
        case "lost":
            return head + tail
        case "garbled":
            return head + bytes([byte_at[0] ^ value[0]]) + tail
        case "duplicated":
            return head + byte_at + byte_at + tail
        case "repeated":
            return data + data
        case _:
            return head + value + byte_at + tail


class _FaultSchedule:
    """Times at which a fault occurs: fixed ones, and random ones that never begin during the previous occurrence."""

    def __init__(self, fault: Fault, draws: np.random.Generator, start_s: float) -> None:
        self.fault = fault
        self._fixed_s = sorted(start_s + at_s for at_s in fault.at_s)
        self._random_s = self._draw_times(draws, start_s)
        self._next_random_s = next(self._random_s)

    @property
    def next_s(self) -> float:
        return min(self._next_random_s, self._fixed_s[0] if self._fixed_s else float("inf"))

    def until(self, now_s: float) -> list[float]:
        """Return the times that have passed since the last call [s]."""
        out: list[float] = []
        while self.next_s <= now_s:
            out.append(self.next_s)
            if self._fixed_s and self._fixed_s[0] <= self._next_random_s:
                self._fixed_s.pop(0)
            else:
                self._next_random_s = next(self._random_s)
        return out

    def _draw_times(self, draws: np.random.Generator, now_s: float) -> Iterator[float]:
        while self.fault.per_minute:
            now_s += float(draws.exponential(60.0 / self.fault.per_minute))
            yield now_s
            now_s += self.fault.lasts_s
        while True:
            yield float("inf")


def add_byte_faults(capture: ByteCapture, faults: Sequence[Fault], seed: int) -> ByteCapture:
    """The capture, one record a chunk, with the faults that change single records, drawn as an emulator draws them."""
    kept = [fault for fault in faults if fault.kind in BYTE_FAULT_KINDS]
    if not kept or not len(capture.ends):
        return capture
    times_s = capture.received_s.tolist()
    injector = FaultInjector(kept, seed, times_s[0])
    ends = capture.ends.tolist()
    chunks = [
        injector.corrupt(capture.data[begin:end], False, now_s)[0]
        for begin, end, now_s in zip([0, *ends], ends, times_s, strict=False)
    ]
    sizes = np.array([len(chunk) for chunk in chunks], dtype=np.int64)
    return ByteCapture(b"".join(chunks), np.cumsum(sizes), capture.received_s)


def unapplied_kinds(faults: Sequence[Fault]) -> list[str]:
    """Kinds of the faults that a capture without a line cannot have."""
    return sorted({fault.kind for fault in faults if fault.kind not in BYTE_FAULT_KINDS})
