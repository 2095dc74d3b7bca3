"""A device with every fault for half an hour: every record that it sent undamaged arrives.

The faults are those of `scenarios/emulator_faults.toml`, drawn at random. HARNESS_SOAK_MINUTES changes the duration.
"""

import os
import sys
from bisect import bisect_left
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from threading import Timer

import numpy as np
import pytest

from harness.experiment import prepare_playback
from harness.stream.emulators import serve_emulator
from harness.stream.frame import TrackerFrame
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.is900.driver.is900 import Is900
from harness.stream.line_events import LineEvent
from harness.stream.polhemus.codec.items import STANDARD_LIST, STATION_CHARACTERS, record_type
from harness.stream.polhemus.codec.records import RecordFormat
from harness.stream.polhemus.driver.open_transport import open_transport
from harness.stream.polhemus.driver.transport import LineLost
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.device_state import SentMessage
from harness.stream.polhemus.emulator.pty_port import PtyPort

RECONFIGURING_EVENTS = {"unplugged", "stalled", "silent", "reset", "wrong list", "refused"}
"""After these events the driver configures the device again, and data that arrive meanwhile are ignored."""
CLOSING_S, MAX_DELAY_S = 0.25, 2.0
"""The driver begins to configure this long before its event; other data arrive within `MAX_DELAY_S` [s]."""

NEIGHBOURS = 2
"""Number of messages before and after, counted in sequence, since a busy machine delays neighbours by any time."""

Reading = tuple[int, bytes]
"""Row of a station, and its position as bytes, which is unique within a loop."""


@dataclass
class SoakResult:
    """Everything that was sent and received."""

    sent: list[SentMessage] = field(default_factory=list)
    events: list[LineEvent] = field(default_factory=list)
    received: dict[Reading, list[float]] = field(default_factory=lambda: defaultdict(list))
    """When each reading was received [s]."""
    frames_s: list[float] = field(default_factory=list)
    """When each frame was received [s]."""

    @property
    def frames(self) -> int:
        return len(self.frames_s)

    def add_frame(self, frame: TrackerFrame) -> None:
        self.frames_s.append(frame.received_s)
        for row in np.flatnonzero(frame.position_valid).tolist():
            self.received[row, frame.position_m[row].tobytes()].append(frame.received_s)

    def reconfiguring(self, at_s: float) -> bool:
        """Whether the driver was configuring the device at this time, or about to.

        What the driver has not read when a line is unplugged is lost with the line, however late the driver is to
        notice: the operating system discards it.
        """
        began_s = None
        for event in self.events:
            if event.kind in RECONFIGURING_EVENTS and began_s is None:
                began_s = event.monotonic_s - CLOSING_S
                if event.kind == "unplugged":
                    read = bisect_left(self.frames_s, event.monotonic_s)
                    began_s = min(began_s, self.frames_s[read - 1]) if read else began_s
            elif event.kind == "connected" and began_s is not None:
                if began_s <= at_s <= event.monotonic_s + CLOSING_S:
                    return True
                began_s = None
        return began_s is not None and at_s >= began_s

    def arrived(self, reading: Reading, written_s: float) -> bool:
        times_s = self.received.get(reading, [])
        index = bisect_left(times_s, written_s - CLOSING_S)
        return index < len(times_s) and times_s[index] <= written_s + MAX_DELAY_S


def run_soak(seconds: float, folder: Path, seed: int) -> SoakResult:
    playback, soak = prepare_playback("emulator_faults", stations=4, seed=seed), SoakResult()
    config = EmulatorConfig(faults=playback.scenario.fault, seed=seed)
    stations = playback.samples.stations
    with (
        serve_emulator(playback.samples, config, pty=folder / "tracker", on_sent=soak.sent.append) as device,
        Is900(device.name, DriverConfig(stations=stations), on_event=soak.events.append) as stream,
    ):
        end = Timer(seconds, stream.close)
        end.start()
        for frame in stream:
            soak.add_frame(frame)
        end.join()
    return soak


def count_outcomes(result: SoakResult) -> dict[str, int]:
    """Count outcomes; `missing` are undamaged readings of a working line that never arrived."""
    record_dtype = record_type(STANDARD_LIST)
    first_s = next(event.monotonic_s for event in result.events if event.kind == "connected")
    last_s = result.sent[-1].written_s
    counts = dict.fromkeys(("records", "damaged", "undamaged", "while away", "missing", "beside damage"), 0)
    records = [sent for sent in result.sent if sent.message.station and not sent.unread and sent.written_s > first_s]
    is_damaged = [bool(sent.damage) for sent in result.sent]
    near_damage = {
        id(sent): any(is_damaged[max(n - NEIGHBOURS, 0) : n + NEIGHBOURS + 1]) for n, sent in enumerate(result.sent)
    }
    for sent in records:
        counts["records"] += 1
        if sent.damage or len(sent.data) != record_dtype.itemsize or sent.written_s > last_s - MAX_DELAY_S:
            counts["damaged"] += bool(sent.damage)
            continue
        (record,) = np.frombuffer(sent.data, record_dtype)
        if not record["quality"]:
            continue
        counts["undamaged"] += 1
        position_m = record["position"].astype(float) * RecordFormat().metres_per_unit
        reading = STATION_CHARACTERS.index(record["station"]), position_m.tobytes()
        if result.arrived(reading, sent.written_s):
            continue
        if result.reconfiguring(sent.written_s):
            counts["while away"] += 1
            continue
        counts["missing"] += 1
        counts["beside damage"] += near_damage[id(sent)]
    return counts


def check_result(result: SoakResult, capsys: pytest.CaptureFixture[str]) -> None:
    counts = count_outcomes(result)
    event_counts: dict[str, int] = defaultdict(int)
    for event in result.events:
        event_counts[event.kind] += 1
    with capsys.disabled():
        print(f"\nsoak: {result.frames} frames; {counts}; events {dict(event_counts)}")
    assert counts["undamaged"] > 0.8 * counts["records"] > 0
    assert counts["damaged"] > 0
    assert counts["missing"] == counts["beside damage"], "a record was lost with no damage near it"
    assert counts["missing"] <= max(1, counts["damaged"] // 1000), "damage costs more than one further record in 1,000"
    assert event_counts["connected"] > max(event_counts["unplugged"], event_counts["reset"]) > 0, (
        "the driver did not reconnect each time"
    )
    assert not result.reconfiguring(result.sent[-1].written_s), "the driver did not reconnect in the end"


def test_what_the_driver_had_not_read_is_lost_with_the_line() -> None:
    """A driver that the system does not schedule for 0.4 s while the line goes loses what waits for it, and no more."""
    soak = SoakResult(frames_s=[10.0, 10.025, 10.05, 12.0])
    for kind, at_s in (("connected", 9.0), ("unplugged", 10.45), ("connected", 12.0)):
        soak.events.append(LineEvent(kind, at_s, at_s, ""))  # type: ignore[arg-type]  # each is a kind of event
    assert [soak.reconfiguring(at_s) for at_s in (10.04, 10.055, 10.4, 12.1, 12.3)] == [False, True, True, True, False]
    soak.events[1] = LineEvent("stalled", 10.45, 10.45, "")
    assert not soak.reconfiguring(10.055), "a line that only stalls keeps what waits"


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pty")
def test_the_system_discards_what_waits_in_a_line_that_is_unplugged(tmp_path: Path) -> None:
    port = PtyPort(tmp_path / "tracker")
    line = open_transport(port.name)
    assert port.write(b"01 waits")
    assert line.read(2.0) == b"01 waits"
    assert port.write(b"02 waits")
    port.unplug()
    with pytest.raises(LineLost):
        line.read(2.0)
    line.close()


@pytest.mark.slow
def test_a_short_soak(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Half a minute of the faults with fixed times: burst, stall, disconnection."""
    check_result(run_soak(36.0, tmp_path, seed=1), capsys)


@pytest.mark.slow
def test_a_long_soak(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    check_result(run_soak(60.0 * float(os.environ.get("HARNESS_SOAK_MINUTES", "30")), tmp_path, seed=2), capsys)
