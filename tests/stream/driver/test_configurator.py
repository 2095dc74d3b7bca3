"""What the driver says to a device before data flow, and what it refuses."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from harness.core.seeds import generator
from harness.errors import BadInput, UnknownName
from harness.stream.codec.items import BAUD_RATES, SHORT_LIST, STANDARD_LIST, record_size
from harness.stream.codec.replies import StatusRecord
from harness.stream.driver import DriverConfig, DriverTiming, Is900
from harness.stream.driver.rate_measurement import estimate_rate_hz
from harness.stream.emulator.config import EmulatorConfig
from tests.stream.driver.bench import NAMES, Bench, Device, Notes, Played, Scripted, frames_for, swaying


def bench_of(stations: int = 4, rate_hz: float = 50.0, port: str = "bench", **config: Any) -> Bench:
    return Bench(Played(swaying(stations, rate_hz), EmulatorConfig(**config), 1000.0), port)


def emulated(bench: Bench) -> Any:
    assert isinstance(bench.device, Played)
    return bench.device.emulator.device


def test_it_says_what_it_must_in_order() -> None:
    bench = bench_of(2)
    stream = bench.driver()
    assert bytes(bench.sent) == (
        b"\x11\rcSl*\r\nMP\r\nfuMT\r\n"
        b"O1,40,2,11,21,1\r\nO1\r\nO2,40,2,11,21,1\r\nO2\r\n"  # told, with the answer to pace it
        b"SMS\r\nO1\r\nO2\r\n"  # and asked
        b"Cc"  # and measured
    )
    bench.sent.clear()
    assert len(frames_for(stream, bench, 1.0)) > 40
    assert bytes(bench.sent) == b"MZ\r\nC"
    stream.close()
    assert bytes(bench.sent) == b"MZ\r\nCc"
    assert not emulated(bench).streaming
    assert bench.open_lines == 0


def test_what_the_device_is() -> None:
    bench = bench_of(3, rate_hz=60.0, status_bytes=54, firmware="4.1402", identification="IS900VWT")
    stream = bench.driver(DriverConfig(stations=("head", "left", "right")))
    assert (stream.firmware, stream.identification, stream.baud) == ("4.1402", "IS900VWT", 115200)
    assert stream.stations == ("head", "left", "right")
    assert (stream.wire.characters, stream.wire.rate_hz, stream.wire.items) == (b"123", 60.0, STANDARD_LIST)


@pytest.mark.parametrize(
    "wanted",
    [
        DriverConfig(),
        DriverConfig(centimetres=False),
        DriverConfig(milliseconds=False),
        DriverConfig(items=SHORT_LIST),
        DriverConfig(items=(40, 2, 4, 21, 22, 23, 0), centimetres=False, milliseconds=False),
    ],
)
def test_every_unit_and_list_gives_the_same_motion(wanted: DriverConfig) -> None:
    bench = bench_of()
    samples = swaying(4)
    with bench.driver(wanted) as stream:
        frames = frames_for(stream, bench, 1.0)
    assert len(frames) > 40
    device = emulated(bench).settings
    assert device.binary
    assert device.centimetres == wanted.centimetres
    assert device.microseconds != wanted.milliseconds
    for frame in frames:
        k = round(frame.measured_s[0] * samples.rate_hz) % len(samples)
        np.testing.assert_allclose(frame.position_m, samples.position_m[k], atol=1e-3)
        turned = np.abs(np.sum(frame.tracker_from_station * samples.tracker_from_station[k], axis=1))
        np.testing.assert_allclose(turned, 1.0, atol=1e-6)
        assert frame.position_valid.all()
        assert not frame.suspect.any()


def test_a_device_left_streaming_suspended_or_amid_a_line_is_brought_to_order() -> None:
    for left in (b"C", b"fC", b"C\x13", b"O1,2,", b"O2,2,1\rfC\x13*reset"):
        bench = bench_of()
        assert bench.device is not None
        bench.device.receive(left, bench.now_s)
        bench.sleep(0.5)
        with bench.driver() as stream:
            assert len(frames_for(stream, bench, 0.5)) > 20, left


def deaf(bench: Bench, *unheard: bytes) -> Bench:
    """A device that takes these for bytes without a meaning."""
    device = bench.device
    assert device is not None
    receive = device.receive

    def told(data: bytes, now_s: float) -> None:
        for word in unheard:
            data = data.replace(word, b"?" * len(word.rstrip()) + word[len(word.rstrip()) :])
        receive(data, now_s)

    device.receive = told  # type: ignore[method-assign]  # a wire that eats words
    return bench


def test_a_device_that_does_not_know_11_is_stopped_all_the_same() -> None:
    bench = deaf(bench_of(), b"\x11")
    emulated(bench).receive(b"fC", bench.now_s)
    with bench.driver() as stream:
        assert len(frames_for(stream, bench, 0.5)) > 20


def test_stations_are_those_of_mp_or_those_named_where_the_device_does_not_answer() -> None:
    bench = deaf(bench_of(3), b"l*\r\n")
    with bench.driver() as stream:
        assert stream.stations == ("1", "2", "3")
        assert len(frames_for(stream, bench, 0.5)) > 20
    bench = deaf(bench_of(2), b"l*\r\n", b"MP\r\n")
    with pytest.raises(BadInput, match=r"does not answer l\* nor MP.*Name the stations"):
        bench.driver()
    with bench.driver(DriverConfig(stations=("head", "hand"))) as stream:
        assert stream.wire.characters == b"12"
        assert len(frames_for(stream, bench, 0.5)) > 20
        bench.plugged = False
        bench.after(1.0, lambda: setattr(bench, "plugged", True))
        assert len(frames_for(stream, bench, 8.0)) > 20
        assert bench.kinds == ["connected", "unplugged", "connected"]


def test_nobody_is_spoken_to_who_was_not_named() -> None:
    bench = bench_of()
    with pytest.raises(BadInput, match="elsewhere"):
        bench.open("elsewhere", 9600)
    bench.opened.clear()
    with bench.driver() as stream:
        frames_for(stream, bench, 0.2)
    assert {port for port, _ in bench.opened} == {"bench"}


@pytest.mark.parametrize("baud", BAUD_RATES)
def test_the_rate_of_the_line_is_found(baud: int) -> None:
    bench = bench_of(1, rate_hz=10.0, baud=baud)

    def heard(data: bytes) -> bytes:
        return data if bench.opened[-1][1] == baud else bytes(len(data))

    device = bench.device
    assert device is not None
    receive = device.receive
    device.receive = lambda data, now_s: receive(heard(data), now_s)  # type: ignore[method-assign]  # the wire
    bench.spoil = heard
    with bench.driver() as stream:
        assert stream.baud == baud
    assert [rate for _, rate in bench.opened] == list(BAUD_RATES[: BAUD_RATES.index(baud) + 1])
    with pytest.raises(BadInput, match=r"at 300 baud.*leave it out"):
        bench.driver(DriverConfig(baud=300))
    assert bench.open_lines == 0


def test_over_tcp_there_is_no_rate_to_find_and_no_line_to_fill() -> None:
    bench = bench_of(6, rate_hz=180.0, port="tcp://bench:5005", paced=False)
    with bench.driver() as stream:
        assert stream.baud is None
        assert len(frames_for(stream, bench, 0.5)) > 80
    assert len(bench.opened) == 1


def test_stations_are_the_active_ones_in_order_and_others_are_off_for_as_long() -> None:
    bench = bench_of(6)
    device = emulated(bench)
    for switched_off in (b"l2,0\r\n", b"l5,0\r\n"):
        device.receive(switched_off, bench.now_s)
    with bench.driver(DriverConfig(stations=("a", "b", "c"))) as stream:
        assert stream.wire.characters == b"134"
        frames = frames_for(stream, bench, 0.5)
        assert [station.active for station in device.settings.stations[:6]] == [True, False, True, True, False, False]
    assert [station.active for station in device.settings.stations[:6]] == [True, False, True, True, False, True]
    heights_m = np.array([0.0, 0.2, 0.3])
    np.testing.assert_allclose(frames[-1].position_m[:, 2], heights_m, atol=1e-6)
    assert bench.driver().stations == ("1", "3", "4", "6")


def test_boresight_and_alignment_are_asked_for_once_each() -> None:
    bench = bench_of(2)
    frame = ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0))
    with bench.driver(DriverConfig(stations=NAMES[:2], alignment={"torso": frame}, boresight=True)) as stream:
        before = frames_for(stream, bench, 0.2)
    said = bytes(bench.sent)
    assert b"R2\r\nA2,0.00,0.00,0.00,0.00,100.00,0.00,-100.00,0.00,0.00\r\n" in said
    assert b"A1" not in said
    assert said.count(b"B1\r\n") == said.count(b"B2\r\n") == 1
    x, y, z = before[0].position_m[1]
    k = round(before[0].measured_s[0] * 50.0)
    expected = swaying(2).position_m[k, 1]
    np.testing.assert_allclose([x, y, z], [expected[1], -expected[0], expected[2]], atol=1e-5)


def test_a_frame_that_the_device_refuses_is_told_in_its_words() -> None:
    bench = bench_of(1)
    with pytest.raises(BadInput, match=r"refuses its frame\. It said: A1,.*: error -3"):
        bench.driver(DriverConfig(alignment=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))))
    assert bench.open_lines == 0


def test_the_rate_is_the_devices_the_users_or_measured() -> None:
    assert bench_of(rate_hz=60.0).driver().wire.rate_hz == 60.0
    assert bench_of(rate_hz=59.94).driver(DriverConfig(rate_hz=59.94)).wire.rate_hz == 59.94
    for items in (STANDARD_LIST, (40, 2, 11, 1)):
        bench = bench_of(2, rate_hz=37.5)
        bench.spoil = lambda data: data.replace(b"31P", b"31@")  # an answer that no source describes
        rate_hz = bench.driver(DriverConfig(items=items)).wire.rate_hz
        assert abs(rate_hz - 37.5) < (0.01 if 21 in items else 1.0)


def test_records_are_believed_where_they_say_another_rate_than_the_device() -> None:
    """`MP` tells how often the device updates; that it reports as often is documented nowhere."""

    def boasting() -> Bench:
        bench = bench_of(2, rate_hz=40.0)
        bench.spoil = lambda data: data.replace(b"   40  ", b"  120  ")
        return bench

    assert boasting().driver().wire.rate_hz == pytest.approx(40.0, rel=1e-3)
    assert boasting().driver(DriverConfig(rate_hz=40.0)).wire.rate_hz == 40.0
    with pytest.raises(BadInput, match="120 Hz is asked for, the device runs at 40 Hz"):
        boasting().driver(DriverConfig(rate_hz=120.0))


def test_a_rate_that_only_mp_tells_fills_no_line() -> None:
    """Four stations of 38 bytes at 120 Hz would not fit; they come at 50 Hz, which does."""
    bench = bench_of(4, rate_hz=50.0)
    bench.spoil = lambda data: data.replace(b"   50  ", b"  120  ")
    assert bench.driver().wire.rate_hz == pytest.approx(50.0, rel=1e-3)


@pytest.mark.parametrize("stations", [4, 6])
def test_a_line_that_is_too_full_shows_though_mp_tells_nothing(stations: int) -> None:
    bench = bench_of(stations, rate_hz=120.0)
    bench.spoil = lambda data: data.replace(b"31P", b"31@")
    with pytest.raises(BadInput, match="and the line carries 115200"):
        bench.driver()


@pytest.mark.parametrize(("missing", "jitter"), [(0.0, 0.2), (0.3, 0.1), (0.5, 0.1)])
def test_the_rate_of_stamps_that_jitter_while_rounds_are_missing(missing: float, jitter: float) -> None:
    rng = generator(1, "jittered stamps")
    for rate_hz in (40.0, 59.94, 180.0):
        stamps_s = (np.arange(200) + rng.uniform(-jitter, jitter, 200)) / rate_hz
        kept = rng.uniform(size=200) >= missing
        kept[[0, -1]] = True
        assert estimate_rate_hz(stamps_s[kept]) == pytest.approx(rate_hz, rel=3e-3)


def test_spoilt_stamps_make_no_other_rate() -> None:
    stamps_s = np.arange(50) / 50.0
    stamps_s[[10, 30]] = 1e9, 0.0
    assert estimate_rate_hz(stamps_s) == pytest.approx(50.0, rel=1e-6)
    assert estimate_rate_hz(np.array([0.0, 1.0])) is None
    assert estimate_rate_hz(np.zeros(50)) is None


OTHER = StatusRecord(identification="FASTRAK", firmware="2.10").line()


@pytest.mark.parametrize(
    ("wanted", "config", "says"),
    [
        (
            DriverConfig(stations=NAMES),
            {"stations": 4},
            r"6 stations wanted \(head, .*\), the device has 4 active \(1, 2, 3, 4\)",
        ),
        (
            DriverConfig(),
            {"firmware": "4.1105"},
            r"firmware 4\.1105 does not know item 40.*Take quality 'mp' \(--quality mp\)",
        ),
        (DriverConfig(items=(76, 2, 11, 21, 1)), {"firmware": "4.2301"}, r"firmware 4\.2301 does not know item 76"),
        (DriverConfig(rate_hz=75.0), {}, r"75 Hz is asked for, the device runs at 50 Hz"),
        (
            DriverConfig(rate_hz=120.0),
            {"stations": 6},
            r"x 120 Hz are 273600 bit/s, and the line carries 115200\. Try 2 stations",
        ),
        (
            DriverConfig(),
            {"stations": 4, "rate_hz": 120.0},
            r"Try 2 stations, or the 22-byte list \(--items 40,18,19,21,1\), or a device .* 75",
        ),
        (DriverConfig(baud=9600), {"baud": 9600}, r"the line carries 9600\. Try .*or a device set to 115200 baud"),
    ],
)
def test_what_a_device_cannot_do_is_refused_with_what_to_try(
    wanted: DriverConfig, config: Mapping[str, Any], says: str
) -> None:
    bench = bench_of(**config)
    with pytest.raises(BadInput, match=says) as raised:
        bench.driver(wanted)
    assert "\n" not in str(raised.value)
    assert bench.open_lines == 0
    assert not emulated(bench).streaming


@pytest.mark.parametrize(
    ("device", "says"),
    [
        (lambda: None, "nothing answers at 115200, 57600, 38400, 19200, 9600 baud"),
        (lambda: Scripted({}), "nothing answers"),
        (lambda: Scripted({b"S": b"OK\r\n"}), "no answer of an IS-900"),
        (lambda: Scripted({b"S": b"21S3F0 cut"}), "no answer of an IS-900"),
        (lambda: Scripted({}, chatter=b"$GPGGA,123519,4807.038,N\r\n"), "no answer of an IS-900"),
        (lambda: Scripted({}, chatter=bytes(range(256))), "no answer of an IS-900"),
        (lambda: Scripted({b"S": OTHER}), "'FASTRAK', firmware 2.10, answers, which is no IS-900"),
        (lambda: Scripted({b"S": StatusRecord().line()}), r"does not answer l\* nor MP"),
        (
            lambda: Scripted({b"S": StatusRecord().line(), b"l*": b"21l" + b"0" * 32 + b"\r\n"}),
            "no station of the device is active",
        ),
        (
            lambda: Scripted({b"S": StatusRecord().line(), b"l*": b"21l1" + b"0" * 31 + b"\r\n"}),
            "does not do as it is told",
        ),
    ],
)
def test_what_is_no_is900_is_refused(device: Callable[[], Device | None], says: str) -> None:
    bench = Bench(device())
    with pytest.raises(BadInput, match=says) as raised:
        bench.driver(DriverConfig(rate_hz=50.0))
    assert "bench" in str(raised.value)
    assert bench.open_lines == 0
    assert bench.now_s < 1030.0


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: DriverConfig(items=(2, 11, 21, 1)), "has no item 40"),
        (lambda: DriverConfig(stations=("head", "head")), "a name twice"),
        (lambda: DriverConfig(rate_hz=-1.0), "180 Hz"),
        (lambda: DriverConfig(baud=0), "0 baud"),
        (lambda: DriverConfig(quality="best"), "Take 'record' or 'mp'"),  # type: ignore[arg-type]  # that is it
    ],
)
def test_a_wish_that_contradicts_itself_is_refused_at_once(make: Callable[[], DriverConfig], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        make()
    with pytest.raises(UnknownName, match="no output item called '99'"):
        DriverConfig(items=(40, 99))


def test_a_lost_first_word_is_said_again() -> None:
    """A set-up in which one answer or setter is damaged ends well, since it is asked for and told again."""
    for at in range(20, 200, 7):
        bench = bench_of(2)
        count = 0

        def spoil(data: bytes, at: int = at) -> bytes:
            nonlocal count
            count += len(data)
            return data[:-1] + b"\x00" if count - len(data) <= at < count else data

        bench.spoil = spoil
        with bench.driver(DriverConfig(rate_hz=50.0), DriverTiming(answer_s=0.2)) as stream:
            assert len(frames_for(stream, bench, 0.2)) >= 8


def test_a_witness_sees_every_byte_and_the_format_before_data() -> None:
    bench, notes = bench_of(2), Notes()
    with Is900("bench", witness=notes, host=bench.host) as stream:
        frames = frames_for(stream, bench, 0.5)
    assert bytes(notes.said) == bytes(bench.sent)
    [(got, said, wire)] = notes.formats
    assert wire == stream.wire
    assert notes.said[said - 4 :] == b"MZ\r\nCc"
    assert record_size(wire.items) * 2 * len(frames) <= len(notes.got) - got
    assert [event.kind for event in notes.events] == ["connected"]
    assert notes.times_s == sorted(notes.times_s)
    assert stream.wall_s(notes.times_s[0]) == pytest.approx(1.7e9 + notes.times_s[0])
