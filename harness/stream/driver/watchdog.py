"""Is all well on the line? Told what comes and when, it finds trouble and says what to do; no input or output.

Trouble is told once, until records have come again. What the device is asked meanwhile it answers between records, so
that nothing is lost where all was well.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from harness.stream.codec.reader import FrameReader, WireFormat
from harness.stream.codec.replies import OutputList, ParsedReply, StatusRecord, parse_reply
from harness.stream.driver.config import DriverTiming
from harness.stream.frame import TrackerFrame
from harness.stream.line_events import LineEventKind

RecoveryAction = Literal["none", "ask", "set up", "reopen"]
"""Ask how the device is, set it up anew, or open the line anew and then set it up."""


@dataclass(frozen=True)
class Diagnosis:
    """Something to be told, something to be done, or both."""

    action: RecoveryAction
    kind: LineEventKind | None = None
    text: str = ""


class Watchdog:
    """Looks on while data flow; `pause` and `start` enclose a set-up."""

    def __init__(self, timing: DriverTiming) -> None:
        self._timing = timing
        self._told: dict[LineEventKind, float] = {}
        """Troubles since records came last, and when each was told [s]."""
        self._wire: WireFormat | None = None
        """While data flow."""
        self._began_s = self._sound_s = self._heard_s = self._asked_s = self._spoilt_s = self._clean_until_s = 0.0
        self._framed_s: float | None = None
        """When the last sound frame came [s]; None before the first."""
        self._device_s = -np.inf
        self._garbage, self._resets, self._zeroed = 0, 0, 0
        self._complaints: dict[str, float] = {}
        """What answers showed amiss, and when [s]."""
        self._connected = False

    def pause(self) -> None:
        """Data do not flow."""
        self._wire = None

    def start(self, wire: WireFormat, now_s: float) -> None:
        """Data are about to flow."""
        self._wire = wire
        self._began_s = self._sound_s = self._heard_s = self._asked_s = now_s
        self._garbage, self._resets, self._zeroed, self._complaints, self._connected = 0, 0, 0, {}, False

    def zeroed(self) -> None:
        """The device's clock was set to zero on purpose."""
        self._zeroed += 1

    def tell(self, kind: LineEventKind, text: str, now_s: float, step: RecoveryAction = "none") -> Diagnosis:
        """The finding, without its words when it was told before."""
        if kind in self._told:
            return Diagnosis(step)
        self._told[kind] = now_s
        return Diagnosis(step, kind, text)

    def framed(self, frames: Sequence[TrackerFrame], now_s: float) -> list[Diagnosis]:
        """Frames came; they are sound when the device's clock goes on."""
        if self._wire is None or not frames:
            return []
        device_s = max(float(np.fmax.reduce(frame.measured_s, initial=-np.inf)) for frame in frames)
        if 21 in self._wire.items and device_s <= self._device_s:
            return []
        news = not self._connected or set(self._told) - {"garbage"}
        again = "" if self._framed_s is None else f" again after {now_s - self._framed_s:.1f} s"
        self._device_s, self._connected = device_s, True
        self._sound_s = self._framed_s = now_s
        self._told = {kind: told_s for kind, told_s in self._told.items() if kind == "garbage"}
        if not news:
            return []
        stations = f"{len(self._wire.stations)} stations at {self._wire.rate_hz:g} Hz"
        return [Diagnosis("none", "connected", f"records come{again}: {stations}")]

    def check(self, now_s: float, came: bool, reader: FrameReader) -> list[Diagnosis]:
        """What is amiss now; `came` tells whether bytes did since the last look."""
        if self._wire is None:
            return []
        if came:
            self._heard_s = now_s
        found = self._garbage_found(now_s, reader)
        found += self._silence_found(now_s)
        while reader.replies:
            found += self._answer(self._wire, parse_reply(reader.replies.popleft().line), now_s)
        if reader.clock_resets > self._resets + self._zeroed:
            found.append(self._ask(now_s))
        if reader.clock_resets > self._resets:
            self._zeroed = max(self._zeroed - 1, 0)
        self._resets = reader.clock_resets
        return found

    def _garbage_found(self, now_s: float, reader: FrameReader) -> list[Diagnosis]:
        more, self._garbage = reader.garbage_bytes - self._garbage, reader.garbage_bytes
        if not more:
            if now_s - self._spoilt_s > self._timing.garbage_s:
                self._told.pop("garbage", None)
            return []
        if now_s - self._spoilt_s > self._timing.garbage_s:
            self._clean_until_s = now_s
        self._spoilt_s = now_s
        found = [self.tell("garbage", f"{more} bytes belong to nothing", now_s)]
        if min(now_s - self._clean_until_s, now_s - self._asked_s) > self._timing.stalled_s:
            found.append(self._ask(now_s))  # it goes on: is it the list that we expect?
        return found

    def _silence_found(self, now_s: float) -> list[Diagnosis]:
        without_s, timing = now_s - self._sound_s, self._timing
        if without_s > timing.silent_s:
            if now_s - self._heard_s < timing.stalled_s:
                return [Diagnosis("set up")]
            return [self.tell("silent", f"no byte for {now_s - self._heard_s:.1f} s", now_s, "reopen")]
        if without_s > timing.stalled_s and now_s - self._asked_s > timing.stalled_s:
            silent = now_s - self._heard_s > timing.stalled_s
            what = "no byte" if silent else "no record that is news"
            return [self.tell("stalled", f"{what} for {without_s:.1f} s", now_s), self._ask(now_s)]
        return []

    def _ask(self, now_s: float) -> Diagnosis:
        self._asked_s = now_s
        return Diagnosis("ask")

    def _answer(self, wire: WireFormat, reply: ParsedReply, now_s: float) -> list[Diagnosis]:
        """A wrong answer may be a damaged one: it counts when it soon comes twice."""
        recent_s = now_s - self._timing.silent_s
        self._complaints = {text: said_s for text, said_s in self._complaints.items() if said_s > recent_s}
        kind, complaint = diagnose_reply(wire, reply)
        if kind is None:
            return []
        if complaint in self._complaints:
            return [self.tell(kind, complaint, now_s, "set up")]
        first = not self._complaints
        self._complaints[complaint] = now_s
        return [self._ask(now_s)] if first else []


def diagnose_reply(wire: WireFormat, reply: ParsedReply, streaming: bool = True) -> tuple[LineEventKind | None, str]:
    """What an answer shows to be otherwise than it was set up, as a kind of trouble and in words."""
    if isinstance(reply, StatusRecord):
        amiss = [
            "it reports in ASCII" if not reply.binary else "",
            "its unit is another" if reply.centimetres != (wire.settings.metres_per_unit == 0.01) else "",
            "it does not stream" if streaming and not reply.continuous else "",
        ]
        if any(amiss):
            return "reset", "the device was reset: " + ", ".join(filter(None, amiss))
    if isinstance(reply, OutputList) and reply.station in wire.characters.decode() and reply.items != wire.items:
        return "wrong list", f"the list of station {reply.station} is {','.join(map(str, reply.items))}"
    return None, ""
