"""The driver of a FASTRAK against the emulator, on a bench with its own time."""

import numpy as np
import pytest

from harness.errors import BadInput
from harness.stream.fastrak.driver import FastrakConfig
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.polhemus.emulator.faults import Fault
from tests.stream.fastrak.bench import fastrak_bench, open_fastrak
from tests.stream.is900.driver.bench import LineLog, bench_of, device_of, frames_for

CENTIMETRE_STEP_M, INCH_STEP_M = 0.0001, 0.000254
"""Steps of positions in ASCII: 0.01 units [m]."""


@pytest.mark.parametrize(
    ("items", "binary", "centimetres", "error_m", "error"),
    [
        ((2, 11, 1), True, True, 1e-6, 1e-6),
        ((2, 11, 1), True, False, 1e-6, 1e-6),
        ((2, 4, 1), True, True, 1e-6, 1e-6),
        ((2, 5, 6, 7, 1), True, True, 1e-6, 1e-6),
        ((18, 19, 0), True, True, 4e-4, 4e-4),
        ((2, 11, 1), False, True, CENTIMETRE_STEP_M, 1e-4),
        ((2, 4, 1), False, False, INCH_STEP_M, 1e-4),
    ],
)
def test_frames_are_the_samples(
    items: tuple[int, ...], binary: bool, centimetres: bool, error_m: float, error: float
) -> None:
    bench = fastrak_bench(rate_hz=40.0)
    config = FastrakConfig(items=items, binary=binary, centimetres=centimetres)
    with open_fastrak(bench, config) as driver:
        frames = frames_for(driver, bench, 2.0)
        samples = device_of(bench).samples
    assert (driver.stations, driver.wire.rate_hz) == (("1", "2", "3"), 40.0)
    assert len(frames) == pytest.approx(80, abs=2)
    for frame in frames:
        assert frame.position_valid.all()
        assert frame.orientation_valid.all()
        assert not frame.suspect.any()
        assert np.isnan(frame.measured_s).all(), "a FASTRAK has no time stamps"
        row = np.abs(samples.position_m[:, 0] - frame.position_m[0]).sum(axis=1).argmin()
        np.testing.assert_allclose(frame.position_m, samples.position_m[row], atol=error_m)
        np.testing.assert_allclose(
            np.abs(np.sum(frame.tracker_from_station * samples.tracker_from_station[row], axis=1)), 1.0, atol=error
        )
    received_s = np.array([frame.received_s for frame in frames])
    assert np.all(np.diff(received_s) > 0.0)


@pytest.mark.parametrize(("stations", "rate_hz"), [(1, 120.0), (2, 60.0), (4, 30.0)])
def test_the_stations_share_120_records_per_second(stations: int, rate_hz: float) -> None:
    bench = fastrak_bench(stations=stations, rate_hz=rate_hz)
    with open_fastrak(bench) as driver:
        assert driver.wire.rate_hz == rate_hz


def test_the_rate_is_measured_where_it_is_another() -> None:
    """A slow line, or a synchronisation with a video signal."""
    bench = fastrak_bench(stations=2, rate_hz=50.0)
    with open_fastrak(bench) as driver:
        assert driver.wire.rate_hz == pytest.approx(50.0, abs=1.5)
    with pytest.raises(BadInput, match=r"60 Hz is requested, but the device runs at (49|50|51)"):
        open_fastrak(bench, FastrakConfig(rate_hz=60.0))


def test_the_device_gets_its_settings_back() -> None:
    bench = fastrak_bench()
    device_of(bench).receive(b"O2,4,2,1\rUI2,1.5\r", bench.now_s)
    found = device_of(bench).settings
    with open_fastrak(bench, FastrakConfig(stations=("a", "b"))) as driver:
        frames_for(driver, bench, 0.5)
        during = device_of(bench).settings
        assert during.station("2").items == (2, 11, 1)
        assert during.station("2").increment_m == 0.0
        assert "station 2 had an increment" in bench.events[0].text
        assert during.centimetres
        assert during.binary
        assert not during.station("3").active, "it would load the line"
        assert "not read: 3" in driver.station_list
    assert device_of(bench).settings == found
    assert not device_of(bench).streaming
    assert b"M" not in bench.sent, "commands of InterSense"


def test_the_driver_says_what_the_device_is() -> None:
    """`S` has the text of `X` in place of a name."""
    with open_fastrak(fastrak_bench()) as driver:
        assert driver.identification == "FASTRAK, firmware 3.02"


def test_a_device_that_was_reset_is_set_up_again() -> None:
    bench = fastrak_bench(Fault("reset", at_s=(8.0,)))
    with open_fastrak(bench) as driver:
        frames = frames_for(driver, bench, 12.0)
    assert "reset" in bench.kinds
    gaps = np.diff([frame.received_s for frame in frames])
    assert 0.2 < gaps.max() < 3.0
    assert not any(frame.suspect.any() for frame in frames)


@pytest.mark.parametrize(("letter", "suspect"), [(b"k", True), (b"x", True), (b"n", False), (b" ", False)])
def test_an_error_of_the_pose_makes_a_reading_suspect(letter: bytes, suspect: bool) -> None:
    """`k` is a low signal, `x` a receiver outside its box, `n` an error of the memory, long before."""
    bench = fastrak_bench(stations=1, rate_hz=120.0)
    with open_fastrak(bench) as driver:
        bench.corrupt = lambda data: data.replace(b"01 ", b"01" + letter)
        frames = frames_for(driver, bench, 0.5)
    assert len(frames) > 50
    assert {bool(frame.suspect[0]) for frame in frames} == {suspect}
    texts = [event.text for event in bench.events if event.kind == "device error"]
    assert len(texts) == (letter != b" "), "once, and not for each record"
    assert all(f"station 1 reports error {letter.decode()} " in text for text in texts)
    assert all(("are suspect" in text) == suspect for text in texts)


def test_a_station_that_another_program_switches_off_is_reported() -> None:
    bench = fastrak_bench()
    bench.schedule(4.0, lambda: device_of(bench).receive(b"l2,0\r", bench.now_s))
    with open_fastrak(bench, FastrakConfig(stations=("a", "b", "c"))) as driver:
        frames = frames_for(driver, bench, 6.0)
    (event,) = [event for event in bench.events if event.kind == "missing"]
    assert "station 2 (b) is switched off" in event.text
    assert frames[-1].position_valid.tolist() == [True, False, True]


def test_the_format_names_the_family() -> None:
    bench, log = fastrak_bench(), LineLog()
    with open_fastrak(bench, FastrakConfig(stations=("a", "b", "c")), log) as driver:
        frames_for(driver, bench, 0.2)
    ((_, _, wire),) = log.formats
    assert (wire.family, wire.zeroed, wire.stations) == ("fastrak", False, ("a", "b", "c"))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"items": (40, 2, 11, 1)}, "Output item 40 of a FASTRAK is not known"),
        ({"items": (2, 3)}, "Output item 3 "),
        ({"stations": ("1", "5")}, "Station characters '15' do not fit"),
        ({"rate_hz": 0.0}, "up to 120 Hz"),
    ],
)
def test_what_a_fastrak_cannot_do_is_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        FastrakConfig(**options)  # type: ignore[arg-type]
    with pytest.raises(BadInput, match="A FASTRAK has 1 to 4"):
        WireFormat(("a", "b", "c", "d", "e"), 24.0, family="fastrak")


def test_the_families_know_each_other() -> None:
    """The name of a port says which device is there; another one is refused with the right name."""
    with pytest.raises(BadInput, match=r"'IS900VET', firmware 4\.2301, is no FASTRAK") as refused:
        open_fastrak(bench_of(port="fastrak:bench"))
    assert "Name it bench." in str(refused.value)
    bench = fastrak_bench()
    bench.port = "bench"
    with pytest.raises(BadInput, match="is no IS-900") as refused:
        bench.driver()
    assert "a FASTRAK is at fastrak:bench" in str(refused.value)


def test_a_device_without_the_queries_of_lists_is_used_all_the_same() -> None:
    """The manual does not say what `O1` without a list returns."""
    bench = fastrak_bench()
    bench.corrupt = lambda data: b"" if data[2:3] == b"O" else data
    with open_fastrak(bench) as driver:
        assert len(frames_for(driver, bench, 0.5)) > 15
