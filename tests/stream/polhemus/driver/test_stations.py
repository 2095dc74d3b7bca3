"""Stations that are switched on and off while data flow: events by name, and frames whose stations never change."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadInput
from harness.stream.frame import TrackerFrame
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.is900.driver.is900 import Is900
from harness.stream.polhemus.codec.reader import FrameReader, WireFormat
from harness.stream.polhemus.codec.samples import DeviceSamples
from harness.stream.polhemus.driver.config import DriverTiming
from harness.stream.polhemus.driver.station_watch import StationWatch
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.recording.recording import read_recording
from harness.stream.recording.recording_writer import RecordingWriter
from harness.stream.recording.replay import RecordingStream
from tests.stream.is900.driver.bench import START_S, Bench, EmulatedDevice, device_of, frames_for, make_samples

WATCHED = ("missing", "present", "unexpected", "garbage")


def make_bench(characters: str = "1234") -> Bench:
    return Bench(EmulatedDevice(make_samples(len(characters), 40.0), EmulatorConfig(characters=characters), START_S))


def switch(bench: Bench, line: bytes) -> Callable[[], None]:
    """Return an action of someone at the device's other port."""
    return lambda: device_of(bench).receive(line, bench.now_s)


def texts(bench: Bench) -> list[tuple[str, str]]:
    return [(event.kind, event.text) for event in bench.events if event.kind in WATCHED]


def test_a_station_that_is_switched_off_and_on_again_is_told_by_name() -> None:
    bench = make_bench()
    with bench.driver(DriverConfig(stations=("head", "torso", "left", "right"))) as stream:
        frames_for(stream, bench, 1.0)
        switch(bench, b"l2,0\r")()
        off = frames_for(stream, bench, 3.0)
        assert texts(bench) == [
            ("missing", "station 2 (torso) is switched off: its rows are invalid until it comes back")
        ]
        assert bench.events[-1].monotonic_s - off[0].received_s < 1.5
        assert all(frame.position_valid.tolist() == [True, False, True, True] for frame in off[2:])
        switch(bench, b"l2,1\r")()
        on = frames_for(stream, bench, 3.0)
        assert texts(bench)[1:] == [("present", "station 2 (torso) sends records again")]
        assert all(frame.position_valid.all() for frame in on[2:])
        switch(bench, b"l1,0\rl4,0\r")()
        frames_for(stream, bench, 2.0)
        assert [text.split(" is")[0] for _, text in texts(bench)[2:]] == ["station 1 (head)", "station 4 (right)"]
        assert stream.stations == ("head", "torso", "left", "right")


@pytest.mark.parametrize("items", [None, b"2,4,1", b"40,2,11,21,1", b"2,11"])
def test_a_station_outside_the_session_is_told_by_name_and_is_no_garbage(items: bytes | None) -> None:
    """Whatever list it has. The stations of the session stay whole, and the line is as the session needs it."""
    bench = make_bench("1245A")
    switch(bench, b"l5,0\rlA,0\r" + (b"OA,%b\r" % items if items else b""))()
    with bench.driver(DriverConfig(stations=("a", "b", "c"))) as stream:
        frames_for(stream, bench, 1.0)
        switch(bench, b"lA,1\r")()
        frames = frames_for(stream, bench, 3.0)
        ((kind, text),) = texts(bench)
        assert kind == "unexpected"
        assert text.startswith("station A was switched on: it is none of this session; it is switched off")
        assert stream.stations == ("a", "b", "c")
        assert all(frame.position_valid.all() for frame in frames[:-1])
        assert len(frames) >= 115
        assert device_of(bench).active == "124", "it is off while the session needs the line"
        switch(bench, b"lA,1\r")()
        frames_for(stream, bench, 3.0)
        assert [kind for kind, _ in texts(bench)] == ["unexpected", "unexpected"], "told each time"
        assert device_of(bench).active == "124"
    assert device_of(bench).active == "124A", "as the one who switched it on left it"


def test_all_stations_that_are_switched_off_are_told_and_return() -> None:
    bench = make_bench("13")
    with bench.driver() as stream:
        frames_for(stream, bench, 1.0)
        switch(bench, b"l1,0\rl3,0\r")()
        frames = frames_for(stream, bench, 5.0)
    kinds = [kind for kind, _ in texts(bench)]
    assert kinds[:2] == ["missing", "missing"]
    assert kinds[2:] == ["present", "present"]
    assert frames[-1].position_valid.all()


def test_a_silent_station_is_told_where_the_device_does_not_answer() -> None:
    bench = make_bench()
    with bench.driver() as stream:
        frames_for(stream, bench, 1.0)
        bench.corrupt = lambda data: data.replace(b"21l", b"2xl").replace(b"31P", b"3xP")
        switch(bench, b"l3,0\r")()
        frames_for(stream, bench, 4.0)
    assert ("missing", "station 3 sends no record for 2.0 s: its rows are invalid until it comes back") in texts(bench)


def test_one_damaged_station_character_is_no_news() -> None:
    watch, wire = StationWatch(DriverTiming()), WireFormat(("head", "torso"), 40.0)
    watch.start(wire, 0.0)
    now_s, totals = 0.0, {"1": 0, "2": 0, "5": 0}
    for k in range(400):
        now_s += 0.025
        totals["1"] += 1
        totals["2"] += 1
        totals["5"] += k % 50 == 49  # one in 1.25 s
        assert watch.update(totals, now_s) == []
    totals["5"] += 1
    now_s += 2.0
    assert watch.update(totals, now_s) == []
    events = []
    for _ in range(3):
        totals["5"] += 1
        events += watch.update(totals, now_s)
    assert [(event.kind, event.station) for event in events] == [("unexpected", "5")]


def test_the_first_record_after_a_silence_of_all_makes_no_other_station_missing() -> None:
    watch, wire = StationWatch(DriverTiming()), WireFormat(("head", "torso"), 40.0)
    watch.start(wire, 0.0)
    assert watch.update({"1": 1, "2": 1}, 0.1) == []
    assert watch.update({"1": 1, "2": 1}, 9.0) == []
    assert watch.update({"1": 2, "2": 1}, 10.0) == []
    assert watch.update({"1": 2, "2": 2}, 10.1) == []
    for k in range(19):
        assert watch.update({"1": 3 + k, "2": 2}, 10.2 + 0.1 * k) == []
    assert [event.kind for event in watch.update({"1": 100, "2": 2}, 12.15)] == ["missing"]


def test_a_device_that_is_slow_by_nature_has_no_missing_stations() -> None:
    bench = Bench(EmulatedDevice(make_samples(2, 0.5), None, START_S))
    timing = DriverTiming(silent_s=20.0, stalled_s=5.0)
    with bench.driver(DriverConfig(rate_hz=0.5), timing) as stream:
        frames_for(stream, bench, 30.0)
    assert texts(bench) == []


def test_the_events_are_in_the_recording_and_its_replay_counts_the_same(tmp_path: Path) -> None:
    bench, path = make_bench("1345"), tmp_path / "take.rec"
    with (
        RecordingWriter(path) as writer,
        Is900("bench", DriverConfig(stations=("a", "b")), observer=writer, host=bench.host) as stream,
    ):
        frames_for(stream, bench, 1.0)
        switch(bench, b"l3,0\r")()
        frames_for(stream, bench, 2.0)
        switch(bench, b"l3,1\rl5,1\r")()
        frames_for(stream, bench, 2.0)
    kinds = [event["kind"] for event in read_recording(path).events]
    assert [kind for kind in kinds if kind in WATCHED] == ["missing", "present", "unexpected"]


def test_records_of_another_station_are_told_apart_from_garbage_at_every_split() -> None:
    device = device_of(make_bench("12"))
    device.receive(b"fuO1,40,2,11,21,1\rO2,2,4,1\rMZ\rC", START_S)
    data = device.advance(START_S + 0.1)
    wire = WireFormat(("head",), 40.0)
    expected = None
    for cut in range(1, len(data)):
        reader = FrameReader(wire)
        reader.feed(data[:cut], 0.0)
        reader.feed(data[cut:], 0.0)
        reader.finish()
        counts = dict(reader.station_records), reader.garbage_bytes, reader.other_bytes, reader.records
        expected = expected or counts
        assert counts == expected, cut
    assert expected is not None
    stations, garbage_bytes, other_bytes, records = expected
    assert stations["1"] == records > 2
    assert stations["2"] >= records - 1
    assert garbage_bytes == other_bytes == 29 * stations["2"]


SPARSE = ("1357", "29", "3AB", "C", "24", "123456789ABC")


def make_unit(characters: str, rate_hz: float = 20.0) -> tuple[Bench, DeviceSamples]:
    count = len(characters)
    samples = replace(make_samples(count, rate_hz), stations=tuple(f"s{c}" for c in characters))
    return Bench(EmulatedDevice(samples, EmulatorConfig(characters=characters), START_S)), samples


def check_frames(frames: list[TrackerFrame], samples: DeviceSamples, rows: list[int]) -> None:
    """Check that every row of every frame is the reading of its station."""
    assert len(frames) > 10
    for frame in frames[1:-1]:
        assert frame.position_valid.tolist() == [True] * len(rows)
        k = round(frame.measured_s[0] * samples.rate_hz - 0.2) % len(samples)
        np.testing.assert_allclose(frame.position_m, samples.position_m[k, rows], atol=1e-6)
        assert not frame.suspect.any()


@pytest.mark.parametrize("characters", SPARSE)
def test_all_stations_are_read_under_their_numbers(characters: str) -> None:
    bench, samples = make_unit(characters)
    with bench.driver() as driver:
        assert driver.stations == tuple(characters)
        assert driver.wire.characters.decode() == characters
        check_frames(frames_for(driver, bench, 1.0), samples, list(range(len(characters))))
        assert driver.counts["garbage_bytes"] == 0
    assert bench.kinds == ["connected"]


@pytest.mark.parametrize("characters", [c for c in SPARSE if len(c) > 1])
def test_some_stations_are_read_by_number_or_in_the_order_of_the_device(characters: str) -> None:
    for config, rows in (
        (DriverConfig(stations=("last",), characters=characters[-1]), [len(characters) - 1]),
        (DriverConfig(stations=("first",)), [0]),
        (DriverConfig(stations=("a", "b"), characters=characters[0] + characters[-1]), [0, len(characters) - 1]),
    ):
        bench, samples = make_unit(characters)
        with bench.driver(config) as driver:
            check_frames(frames_for(driver, bench, 1.0), samples, rows)
            read = ", ".join(f"{characters[row]} {name}" for row, name in zip(rows, driver.stations, strict=True))
            others = ", ".join(character for row, character in enumerate(characters) if row not in rows)
            assert driver.station_list == (f"{read}; not read: {others}" if others else read)
        device = bench.device
        assert isinstance(device, EmulatedDevice)
        assert device.emulator.device.active == characters, "the others are switched on again"


def test_names_that_are_numbers_mean_these_stations() -> None:
    for names, rows in ((("9",), [1]), (("9", "2"), [0, 1])):
        bench, samples = make_unit("29")
        with bench.driver(DriverConfig(stations=names)) as driver:
            assert driver.stations == tuple(sorted(names))
            check_frames(frames_for(driver, bench, 1.0), samples, rows)
    bench, _ = make_unit("29")
    with pytest.raises(BadInput, match=r"no station 1 \(1\); it has 2, 9"):
        bench.driver(DriverConfig(stations=("1",)))


def test_a_recording_of_such_a_unit_replays_the_same_frames(tmp_path: Path) -> None:
    bench, samples = make_unit("29")
    path = tmp_path / "take.rec"
    with (
        RecordingWriter(path) as writer,
        Is900("bench", DriverConfig(stations=("head", "hand")), observer=writer, host=bench.host) as driver,
    ):
        frames = frames_for(driver, bench, 1.0)
    replayed = list(RecordingStream(path))
    assert RecordingStream(path).wire.characters == b"29"
    check_frames(replayed[: len(frames)], samples, [0, 1])
    for first, second in zip(frames, replayed, strict=False):
        np.testing.assert_array_equal(first.position_m, second.position_m)
