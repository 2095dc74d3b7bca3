"""What goes wrong on purpose: a scenario's `[[fault]]` tables, and when each strikes.

Each fault draws from a generator of its own, so that the same seed gives the same faults to the same messages, and
one fault more leaves the others as they were.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from harness.core.seeds import generator
from harness.errors import BadInput

ByteFaultKind = Literal["lost", "garbled", "duplicated", "added"]
FaultEpisodeKind = Literal["burst", "stall", "disconnect", "reset", "lost_station"]
FaultKind = Literal[
    "lost", "garbled", "duplicated", "added", "burst", "stall", "disconnect", "reset", "lost_station", "firmware"
]
BYTE_FAULT_KINDS: tuple[str, ...] = get_args(ByteFaultKind)
FAULT_EPISODE_KINDS: tuple[str, ...] = get_args(FaultEpisodeKind)
_INSTANT_KINDS = (*BYTE_FAULT_KINDS, "reset")
_FIRMWARE = re.compile(r"\d\.\d{2,4}")


def check_firmware(version: str) -> None:
    """BadInput unless it is a version such as the status record tells."""
    if not _FIRMWARE.fullmatch(version):
        raise BadInput(f"firmware {version!r}.", "Give a version such as 4.2301: one digit, a point, two to four.")


@dataclass(frozen=True)
class Fault:
    """One kind of trouble, and when.

    `lost`, `garbled`, `duplicated`, `added`: one byte of a record or reply. `burst`: every byte for a while. `stall`:
    the line says nothing, and what it has no room for is dropped. `disconnect`: the line is unplugged. `reset`: the
    device's power is cut for a moment. `lost_station`: a station out of sight. `firmware`: another version.
    """

    kind: FaultKind
    share: float = 0.0
    """Of the records and replies that lose, change, double or gain a byte, 0 to 1."""
    at_s: tuple[float, ...] = ()
    """Moments after power-on [s]."""
    per_minute: float = 0.0
    """So often at random besides."""
    lasts_s: float = 0.0
    """How long a burst, stall, disconnection or lost sight lasts [s]."""
    station: str = ""
    """The one that is out of sight, by name; "" is the first."""
    firmware: str = ""
    """The other version, such as 4.1105, which has no item 40."""

    def __post_init__(self) -> None:
        told = {
            "share": (self.share != 0.0, self.kind in BYTE_FAULT_KINDS),
            "at_s and per_minute": (bool(self.at_s) or self.per_minute != 0.0, self.kind != "firmware"),
            "lasts_s": (self.lasts_s != 0.0, self.kind not in (*_INSTANT_KINDS, "firmware")),
            "station": (bool(self.station), self.kind == "lost_station"),
            "firmware": (bool(self.firmware), self.kind == "firmware"),
        }
        for name, (given, meant) in told.items():
            if given and not meant:
                raise BadInput(f"fault {self.kind!r} has no {name}.", "Leave it out.")
        if not (0.0 <= self.share <= 1.0 and self.per_minute >= 0.0 and min((0.0, self.lasts_s, *self.at_s)) >= 0.0):
            raise BadInput(f"Not a fault: {self}.", "A share is 0 to 1; times are not negative.")
        if self.kind in FAULT_EPISODE_KINDS and self.kind not in _INSTANT_KINDS and self.lasts_s == 0.0:
            raise BadInput(f"fault {self.kind!r} does not last.", "Give lasts_s.")
        if not (self.share or self.at_s or self.per_minute or self.firmware):
            raise BadInput(f"fault {self.kind!r} never happens.", "Give share, at_s, per_minute or firmware.")
        if self.kind == "firmware":
            check_firmware(self.firmware)


@dataclass(frozen=True, slots=True)
class FaultEpisode:
    """A stretch of time in which something is wrong."""

    fault: Fault
    from_s: float
    to_s: float


class FaultInjector:
    """All faults of a scenario from power-on; asked in order of time."""

    def __init__(self, faults: Iterable[Fault], seed: int, began_s: float) -> None:
        self._byte_faults: list[tuple[Fault, np.random.Generator, _FaultSchedule]] = []
        self._spells: list[_FaultSchedule] = []
        for number, fault in enumerate(faults):
            moments = _FaultSchedule(fault, generator(seed, "fault", number, fault.kind, "when"), began_s)
            draws = generator(seed, "fault", number, fault.kind, "what")
            if fault.kind in BYTE_FAULT_KINDS:
                self._byte_faults.append((fault, draws, moments))
            elif fault.kind in FAULT_EPISODE_KINDS:
                self._spells.append(moments)
        self._noise = generator(seed, "fault", "burst")

    @property
    def next_s(self) -> float:
        """When the next spell begins [s]."""
        return min((moments.next_s for moments in self._spells), default=float("inf"))

    def pop_started(self, now_s: float) -> list[FaultEpisode]:
        """The spells that have begun since this was asked last, in order of time."""
        found: list[FaultEpisode] = []
        for moments in self._spells:
            found += [FaultEpisode(moments.fault, at_s, at_s + moments.fault.lasts_s) for at_s in moments.until(now_s)]
        return sorted(found, key=lambda spell: spell.from_s)

    def corrupt(self, data: bytes, bursting: bool, due_s: float) -> tuple[bytes, tuple[str, ...]]:
        """What becomes of a message that is due at this moment, and the kinds of faults that did it."""
        kinds: list[str] = []
        for fault, draws, moments in self._byte_faults:
            struck = bool(fault.share) and draws.random() < fault.share
            if struck or moments.until(due_s):
                at, byte = int(draws.integers(len(data))), bytes([int(draws.integers(1, 256))])
                data = _corrupt(fault.kind, data, at, byte)
                kinds.append(fault.kind)
        if bursting:
            data = self._noise.bytes(len(data))
            kinds.append("burst")
        return data, tuple(kinds)


def _corrupt(kind: str, data: bytes, at: int, byte: bytes) -> bytes:
    head, own, tail = data[:at], data[at : at + 1], data[at + 1 :]
    match kind:
        case "lost":
            return head + tail
        case "garbled":
            return head + bytes([own[0] ^ byte[0]]) + tail
        case "duplicated":
            return head + own + own + tail
        case _:
            return head + byte + own + tail


class _FaultSchedule:
    """When a fault strikes: at given moments, and at random ones, of which none begins while the last one lasts."""

    def __init__(self, fault: Fault, draws: np.random.Generator, began_s: float) -> None:
        self.fault = fault
        self._given = sorted(began_s + at_s for at_s in fault.at_s)
        self._random = self._drawn(draws, began_s)
        self._next_random_s = next(self._random)

    @property
    def next_s(self) -> float:
        return min(self._next_random_s, self._given[0] if self._given else float("inf"))

    def until(self, now_s: float) -> list[float]:
        """Those that have come [s]."""
        out: list[float] = []
        while self.next_s <= now_s:
            out.append(self.next_s)
            if self._given and self._given[0] <= self._next_random_s:
                self._given.pop(0)
            else:
                self._next_random_s = next(self._random)
        return out

    def _drawn(self, draws: np.random.Generator, now_s: float) -> Iterator[float]:
        while self.fault.per_minute:
            now_s += float(draws.exponential(60.0 / self.fault.per_minute))
            yield now_s
            now_s += self.fault.lasts_s
        while True:
            yield float("inf")
