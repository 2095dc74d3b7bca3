"""A device that does everything wrong for half an hour: every record that it sent undamaged arrives.

The faults are those of `scenarios/emulator_faults.toml`, drawn at random. HARNESS_SOAK_MINUTES changes how long.
"""

import os
from bisect import bisect_left
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from threading import Timer

import numpy as np
import pytest

from harness.experiment.playback import prepare_playback
from harness.stream.codec.items import STANDARD_LIST, STATION_CHARACTERS, record_type
from harness.stream.codec.records import RecordFormat
from harness.stream.driver import DriverConfig, Is900, LineEvent
from harness.stream.emulator import EmulatorConfig, SentMessage, serve_emulator
from harness.stream.frame import TrackerFrame

AWAY = {"unplugged", "stalled", "silent", "reset", "wrong list", "refused"}
"""After these the driver sets the device up anew, and what comes meanwhile is no data to it."""
EDGE_S, PATIENCE_S = 0.25, 2.0
"""What waits in a pipe that is closed is gone; what arrives does so within this."""

BESIDE = 2
"""So many messages before and after: in order, since a busy machine writes neighbours any time apart."""

Reading = tuple[int, bytes]
"""Row of a station, and its position as bytes: no two of a lap are alike."""


@dataclass
class Soak:
    sent: list[SentMessage] = field(default_factory=list)
    events: list[LineEvent] = field(default_factory=list)
    came: dict[Reading, list[float]] = field(default_factory=lambda: defaultdict(list))
    """When each reading came [s]."""
    frames: int = 0

    def take(self, frame: TrackerFrame) -> None:
        self.frames += 1
        for row in np.flatnonzero(frame.position_valid).tolist():
            self.came[row, frame.position_m[row].tobytes()].append(frame.received_s)

    def away(self, at_s: float) -> bool:
        """Whether the driver was setting the device up at this moment, or about to."""
        begun_s = None
        for event in self.events:
            if event.kind in AWAY and begun_s is None:
                begun_s = event.monotonic_s
            elif event.kind == "connected" and begun_s is not None:
                if begun_s - EDGE_S <= at_s <= event.monotonic_s + EDGE_S:
                    return True
                begun_s = None
        return begun_s is not None and at_s >= begun_s - EDGE_S

    def arrived(self, reading: Reading, written_s: float) -> bool:
        times_s = self.came.get(reading, [])
        place = bisect_left(times_s, written_s - EDGE_S)
        return place < len(times_s) and times_s[place] <= written_s + PATIENCE_S


def soak(seconds: float, folder: Path, seed: int) -> Soak:
    played, out = prepare_playback("emulator_faults", stations=4, seed=seed), Soak()
    config = EmulatorConfig(faults=played.scenario.fault, seed=seed)
    with (
        serve_emulator(played.samples, config, pty=folder / "tracker", on_sent=out.sent.append) as device,
        Is900(device.name, DriverConfig(stations=played.samples.stations), on_event=out.events.append) as stream,
    ):
        end = Timer(seconds, stream.close)
        end.start()
        for frame in stream:
            out.take(frame)
        end.join()
    return out


def judge(seen: Soak) -> dict[str, int]:
    """Counts; `missing` are undamaged readings of a working line that never came."""
    kind = record_type(STANDARD_LIST)
    first_s = next(event.monotonic_s for event in seen.events if event.kind == "connected")
    last_s = seen.sent[-1].written_s
    counts = dict.fromkeys(("records", "damaged", "undamaged", "while away", "missing", "beside damage"), 0)
    records = [sent for sent in seen.sent if sent.message.station and not sent.unread and sent.written_s > first_s]
    hurt = [bool(sent.damage) for sent in seen.sent]
    beside = {id(sent): any(hurt[max(n - BESIDE, 0) : n + BESIDE + 1]) for n, sent in enumerate(seen.sent)}
    for sent in records:
        counts["records"] += 1
        if sent.damage or len(sent.data) != kind.itemsize or sent.written_s > last_s - PATIENCE_S:
            counts["damaged"] += bool(sent.damage)
            continue
        (record,) = np.frombuffer(sent.data, kind)
        if not record["quality"]:
            continue
        counts["undamaged"] += 1
        position_m = record["position"].astype(float) * RecordFormat().metres_per_unit
        reading = STATION_CHARACTERS.index(record["station"]), position_m.tobytes()
        if seen.arrived(reading, sent.written_s):
            continue
        if seen.away(sent.written_s):
            counts["while away"] += 1
            continue
        counts["missing"] += 1
        counts["beside damage"] += beside[id(sent)]
    return counts


def check(seen: Soak, capsys: pytest.CaptureFixture[str]) -> None:
    counts = judge(seen)
    told: dict[str, int] = defaultdict(int)
    for event in seen.events:
        told[event.kind] += 1
    with capsys.disabled():
        print(f"\nsoak: {seen.frames} frames; {counts}; events {dict(told)}")
    assert counts["undamaged"] > 0.8 * counts["records"] > 0
    assert counts["damaged"] > 0
    assert counts["missing"] == counts["beside damage"], "a record was lost with no damage near it"
    assert counts["missing"] <= max(1, counts["damaged"] // 1000), "damage costs more than one further record in 1,000"
    assert told["connected"] > max(told["unplugged"], told["reset"]) > 0, "it did not come back each time"
    assert not seen.away(seen.sent[-1].written_s), "it did not come back in the end"


def test_a_short_soak(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Half a minute of the faults that have a time: burst, stall, unplugged."""
    check(soak(36.0, tmp_path, seed=1), capsys)


@pytest.mark.slow
def test_a_long_soak(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    check(soak(60.0 * float(os.environ.get("HARNESS_SOAK_MINUTES", "30")), tmp_path, seed=2), capsys)
