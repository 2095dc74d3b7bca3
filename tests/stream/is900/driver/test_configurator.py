"""What the driver sends to a device before data flow, and what it refuses."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from harness.core.seeds import generator
from harness.errors import BadInput, UnknownName
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.is900.driver.is900 import Is900
from harness.stream.polhemus.codec.items import BAUD_RATES, SHORT_LIST, STANDARD_LIST, record_size
from harness.stream.polhemus.codec.replies import StatusRecord
from harness.stream.polhemus.driver.config import DriverTiming
from harness.stream.polhemus.driver.rate import estimate_rate_hz
from tests.stream.is900.driver.bench import (
    NAMES,
    Bench,
    Device,
    EmulatedDevice,
    LineLog,
    ScriptedDevice,
    bench_of,
    device_of,
    frames_for,
    make_samples,
)


def test_the_commands_are_sent_in_the_right_sequence() -> None:
    bench = bench_of(stations=2)
    stream = bench.driver()
    assert bytes(bench.sent) == (
        b"\x11\rcSl*\r\n"
        b"O1\r\nO2\r\nMS\r\n"  # what other programs have set
        b"A1\r\nN1\r\nG1\r\nMp1\r\nMQ1\r\nMs1\r\nA2\r\nN2\r\nG2\r\nMp2\r\nMQ2\r\nMs2\r\n"
        b"b1\r\nb2\r\nMP\r\nfuMT\r\n"
        b"O1,40,2,11,21,1\r\nO1\r\nO2,40,2,11,21,1\r\nO2\r\n"  # set, with a query to wait for the device
        b"SMS\r\nO1\r\nO2\r\n"  # checked
        b"Cc"  # rate measured
    )
    bench.sent.clear()
    assert len(frames_for(stream, bench, 1.0)) > 40
    assert bytes(bench.sent) == b"MZ\r\nC"
    stream.close()
    assert bytes(bench.sent) == b"MZ\r\nCcO1,2,4,1\r\nO1\r\nO2,2,4,1\r\nO2\r\nMT\r\nUFS"  # as it was
    assert not device_of(bench).streaming
    assert bench.open_lines == 0


def test_device_properties_are_reported() -> None:
    bench = bench_of(stations=3, rate_hz=60.0, status_bytes=54, firmware="4.1402", identification="IS900VWT")
    stream = bench.driver(DriverConfig(stations=("head", "left", "right")))
    assert (stream.identification, stream.baud) == ("IS900VWT, firmware 4.1402", 115200)
    assert stream.stations == ("head", "left", "right")
    assert (stream.wire.characters, stream.wire.rate_hz, stream.wire.items) == (b"123", 60.0, STANDARD_LIST)


@pytest.mark.parametrize(
    "config",
    [
        DriverConfig(),
        DriverConfig(centimetres=False),
        DriverConfig(milliseconds=False),
        DriverConfig(items=SHORT_LIST),
        DriverConfig(items=(40, 2, 4, 21, 22, 23, 0), centimetres=False, milliseconds=False),
    ],
)
def test_every_unit_and_list_gives_the_same_motion(config: DriverConfig) -> None:
    bench = bench_of()
    samples = make_samples(4)
    with bench.driver(config) as stream:
        frames = frames_for(stream, bench, 1.0)
        device = device_of(bench).settings
    assert len(frames) > 40
    assert device.binary
    assert device.centimetres == config.centimetres
    assert device.microseconds != config.milliseconds
    for frame in frames:
        k = round(frame.measured_s[0] * samples.rate_hz) % len(samples)
        np.testing.assert_allclose(frame.position_m, samples.position_m[k], atol=1e-3)
        cosines = np.abs(np.sum(frame.tracker_from_station * samples.tracker_from_station[k], axis=1))
        np.testing.assert_allclose(cosines, 1.0, atol=1e-6)
        assert frame.position_valid.all()
        assert not frame.suspect.any()


def test_positions_beyond_the_range_of_the_list_are_not_valid_and_reported_once() -> None:
    """The stations move out to 4.7 m and back, as walking does."""
    near = make_samples(2)
    far = replace(near, position_m=4.7 * near.position_m)
    bench = Bench(EmulatedDevice(far, now_s=1000.0))
    with bench.driver(DriverConfig(items=SHORT_LIST, stations=("head", "torso"))) as stream:
        frames = frames_for(stream, bench, 10.0)
        counts = stream.counts
    expected = 0
    for frame in frames:
        true_m = far.position_m[round(frame.measured_s[0] * far.rate_hz) % len(far)]
        outside = (np.abs(true_m) >= 3.0).any(axis=1)
        expected += int(outside.sum())
        assert not frame.position_valid[outside].any()
        assert frame.orientation_valid.all()
        assert not frame.suspect.any()
        valid = frame.position_valid
        np.testing.assert_allclose(frame.position_m[valid], true_m[valid], atol=1e-3)
    assert expected > 500
    assert counts["out_of_range"] >= expected
    (event,) = (event for event in bench.events if event.kind == "out of range")
    assert "farther than 3 m from the tracker's origin" in event.text
    assert "40,2,11,21,1" in event.text


def test_emitters_beyond_the_range_of_the_list_are_reported_at_set_up() -> None:
    for items, reported in ((SHORT_LIST, True), (STANDARD_LIST, False)):
        bench = bench_of(stations=2)
        device_of(bench).receive(b"MCF10,3.5,0,0,0,0,1,5010\rMCe\r", bench.now_s)
        bench.driver(DriverConfig(items=items)).close()
        texts = [event.text for event in bench.events if event.kind == "out of range"]
        assert ["emitters are up to 3.50 m" in text for text in texts] == [True] * reported


def test_a_list_that_does_not_cover_the_room_is_refused() -> None:
    DriverConfig(items=SHORT_LIST, reach_m=2.9)
    DriverConfig(reach_m=5.0)
    with pytest.raises(BadInput, match=r"up to 3 m .* reach 4\.71 m\. Use a list with item 2, such as .*40,2,11,21,1"):
        DriverConfig(items=SHORT_LIST, reach_m=4.71)


def test_a_device_left_in_any_state_is_configured() -> None:
    for initial_bytes in (b"C", b"fC", b"C\x13", b"O1,2,", b"O2,2,1\rfC\x13*reset"):
        bench = bench_of()
        assert bench.device is not None
        bench.device.receive(initial_bytes, bench.now_s)
        bench.sleep(0.5)
        with bench.driver() as stream:
            assert len(frames_for(stream, bench, 0.5)) > 20, initial_bytes


def without_commands(bench: Bench, *ignored_commands: bytes) -> Bench:
    """Make the device ignore these commands."""
    device = bench.device
    assert device is not None
    receive = device.receive

    def receive_others(data: bytes, now_s: float) -> None:
        for command in ignored_commands:
            data = data.replace(command, b"?" * len(command.rstrip()) + command[len(command.rstrip()) :])
        receive(data, now_s)

    device.receive = receive_others  # type: ignore[method-assign]  # a wire that drops commands
    return bench


def test_a_device_without_command_11_is_stopped() -> None:
    bench = without_commands(bench_of(), b"\x11")
    device_of(bench).receive(b"fC", bench.now_s)
    with bench.driver() as stream:
        assert len(frames_for(stream, bench, 0.5)) > 20


def test_stations_come_from_mp_or_from_the_user_without_l() -> None:
    bench = without_commands(bench_of(stations=3), b"l*\r\n")
    with bench.driver() as stream:
        assert stream.stations == ("1", "2", "3")
        assert len(frames_for(stream, bench, 0.5)) > 20
    bench = without_commands(bench_of(stations=2), b"l*\r\n", b"MP\r\n")
    with pytest.raises(BadInput, match=r"answers neither l\* nor MP.*Name the stations"):
        bench.driver()
    with bench.driver(DriverConfig(stations=("head", "hand"))) as stream:
        assert stream.wire.characters == b"12"
        assert len(frames_for(stream, bench, 0.5)) > 20
        bench.plugged = False
        bench.schedule(1.0, lambda: setattr(bench, "plugged", True))
        assert len(frames_for(stream, bench, 8.0)) > 20
        assert bench.kinds == ["connected", "unplugged", "connected"]


def test_only_the_named_port_is_opened() -> None:
    bench = bench_of()
    with pytest.raises(BadInput, match="elsewhere"):
        bench.open("elsewhere", 9600)
    bench.opened.clear()
    with bench.driver() as stream:
        frames_for(stream, bench, 0.2)
    assert {port for port, _ in bench.opened} == {"bench"}


@pytest.mark.parametrize("baud", BAUD_RATES)
def test_the_baud_rate_is_detected(baud: int) -> None:
    bench = bench_of(stations=1, rate_hz=10.0, baud=baud)

    def received_at_baud(data: bytes) -> bytes:
        return data if bench.opened[-1][1] == baud else bytes(len(data))

    device = bench.device
    assert device is not None
    receive = device.receive
    device.receive = lambda data, now_s: receive(received_at_baud(data), now_s)  # type: ignore[method-assign]  # the wire
    bench.corrupt = received_at_baud
    with bench.driver() as stream:
        assert stream.baud == baud
    assert [rate for _, rate in bench.opened] == list(BAUD_RATES[: BAUD_RATES.index(baud) + 1])
    with pytest.raises(BadInput, match=r"at 300 baud.*omit it"):
        bench.driver(DriverConfig(baud=300))
    assert bench.open_lines == 0


def test_tcp_has_no_baud_rate_and_no_capacity_limit() -> None:
    bench = bench_of(stations=6, rate_hz=180.0, port="tcp://bench:5005", paced=False)
    with bench.driver() as stream:
        assert stream.baud is None
        assert len(frames_for(stream, bench, 0.5)) > 80
    assert len(bench.opened) == 1


def test_the_first_active_stations_are_read_and_others_switched_off_meanwhile() -> None:
    bench = bench_of(stations=6)
    device = device_of(bench)
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


def test_boresight_and_alignment_are_set_once() -> None:
    bench = bench_of(stations=2)
    frame = ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0))
    with bench.driver(DriverConfig(stations=NAMES[:2], alignment={"torso": frame}, boresight=True)) as stream:
        frames = frames_for(stream, bench, 0.2)
    sent_data = bytes(bench.sent)
    assert b"R2\r\nA2,0.00,0.00,0.00,0.00,100.00,0.00,-100.00,0.00,0.00\r\n" in sent_data
    assert b"A1," not in sent_data
    assert sent_data.count(b"B1\r\n") == sent_data.count(b"B2\r\n") == 1
    x, y, z = frames[0].position_m[1]
    k = round(frames[0].measured_s[0] * 50.0)
    expected = make_samples(2).position_m[k, 1]
    np.testing.assert_allclose([x, y, z], [expected[1], -expected[0], expected[2]], atol=1e-5)


def test_a_refused_alignment_is_reported_with_the_devices_error() -> None:
    bench = bench_of(stations=1)
    with pytest.raises(BadInput, match=r"refuses the alignment or boresight\. The device reported: A1,.*: error -3"):
        bench.driver(DriverConfig(alignment=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))))
    assert bench.open_lines == 0


def test_the_rate_is_reported_given_or_measured() -> None:
    assert bench_of(rate_hz=60.0).driver().wire.rate_hz == 60.0
    assert bench_of(rate_hz=59.94).driver(DriverConfig(rate_hz=59.94)).wire.rate_hz == 59.94
    for items in (STANDARD_LIST, (40, 2, 11, 1)):
        bench = bench_of(stations=2, rate_hz=37.5)
        bench.corrupt = lambda data: data.replace(b"31P", b"31@")  # a reply that no source describes
        rate_hz = bench.driver(DriverConfig(items=items)).wire.rate_hz
        assert abs(rate_hz - 37.5) < (0.01 if 21 in items else 1.0)


def test_the_measured_rate_overrides_the_reported_one() -> None:
    """`MP` reports how often the device updates. No source says that it reports as often."""

    def misreporting() -> Bench:
        bench = bench_of(stations=2, rate_hz=40.0)
        bench.corrupt = lambda data: data.replace(b"   40  ", b"  120  ")
        return bench

    assert misreporting().driver().wire.rate_hz == pytest.approx(40.0, rel=1e-3)
    assert misreporting().driver(DriverConfig(rate_hz=40.0)).wire.rate_hz == 40.0
    with pytest.raises(BadInput, match="120 Hz is requested, but the device runs at 40 Hz"):
        misreporting().driver(DriverConfig(rate_hz=120.0))


def test_a_rate_that_only_mp_reports_does_not_exceed_the_capacity() -> None:
    """Four stations of 38 bytes at 120 Hz would not fit. They arrive at 50 Hz, which does."""
    bench = bench_of(stations=4, rate_hz=50.0)
    bench.corrupt = lambda data: data.replace(b"   50  ", b"  120  ")
    assert bench.driver().wire.rate_hz == pytest.approx(50.0, rel=1e-3)


@pytest.mark.parametrize("stations", [4, 6])
def test_an_overloaded_line_is_refused_without_mp(stations: int) -> None:
    bench = bench_of(stations=stations, rate_hz=120.0)
    bench.corrupt = lambda data: data.replace(b"31P", b"31@")
    with pytest.raises(BadInput, match="but the line carries 115200"):
        bench.driver()


@pytest.mark.parametrize(("missing", "jitter"), [(0.0, 0.2), (0.3, 0.1), (0.5, 0.1)])
def test_the_rate_is_estimated_from_jittered_stamps_with_missing_rounds(missing: float, jitter: float) -> None:
    rng = generator(1, "jittered stamps")
    for rate_hz in (40.0, 59.94, 180.0):
        stamps_s = (np.arange(200) + rng.uniform(-jitter, jitter, 200)) / rate_hz
        is_kept = rng.uniform(size=200) >= missing
        is_kept[[0, -1]] = True
        assert estimate_rate_hz(stamps_s[is_kept]) == pytest.approx(rate_hz, rel=3e-3)


def test_damaged_stamps_do_not_change_the_rate() -> None:
    stamps_s = np.arange(50) / 50.0
    stamps_s[[10, 30]] = 1e9, 0.0
    assert estimate_rate_hz(stamps_s) == pytest.approx(50.0, rel=1e-6)
    assert estimate_rate_hz(np.array([0.0, 1.0])) is None
    assert estimate_rate_hz(np.zeros(50)) is None


FASTRAK_STATUS = StatusRecord(identification="FASTRAK", firmware="2.10").line()


@pytest.mark.parametrize(
    ("config", "device_config", "message"),
    [
        (
            DriverConfig(stations=NAMES),
            {"stations": 4},
            r"6 stations requested \(head, .*\), the device has 4 active \(1, 2, 3, 4\)",
        ),
        (
            DriverConfig(),
            {"firmware": "4.1105"},
            r"firmware 4\.1105 has no item 40.*Use quality 'mp' \(--quality mp\)",
        ),
        (DriverConfig(items=(76, 2, 11, 21, 1)), {"firmware": "4.2301"}, r"firmware 4\.2301 has no item 76"),
        (DriverConfig(rate_hz=75.0), {}, r"75 Hz is requested, but the device runs at 50 Hz"),
        (
            DriverConfig(rate_hz=120.0),
            {"stations": 6},
            r"x 120 Hz are 273600 bit/s, but the line carries 115200\. Try 2 stations",
        ),
        (
            DriverConfig(),
            {"stations": 4, "rate_hz": 120.0},
            r"Try 2 stations, or --items 40,18,19,21,1 \(22 bytes, range 3 m: .*\), or a device .* 75",
        ),
        (DriverConfig(baud=9600), {"baud": 9600}, r"the line carries 9600\. Try .*or a device set to 115200 baud"),
    ],
)
def test_impossible_requests_are_refused_with_remedies(
    config: DriverConfig, device_config: Mapping[str, Any], message: str
) -> None:
    bench = bench_of(**device_config)
    with pytest.raises(BadInput, match=message) as raised:
        bench.driver(config)
    assert "\n" not in str(raised.value)
    assert bench.open_lines == 0
    assert not device_of(bench).streaming


@pytest.mark.parametrize(
    ("device", "message"),
    [
        (lambda: None, "nothing answers at 115200, 57600, 38400, 19200, 9600 baud"),
        (lambda: ScriptedDevice({}), "nothing answers"),
        (lambda: ScriptedDevice({b"S": b"OK\r\n"}), "no reply of an IS-900"),
        (lambda: ScriptedDevice({b"S": b"21S3F0 cut"}), "no reply of an IS-900"),
        (lambda: ScriptedDevice({}, chatter=b"$GPGGA,123519,4807.038,N\r\n"), "no reply of an IS-900"),
        (lambda: ScriptedDevice({}, chatter=bytes(range(256))), "no reply of an IS-900"),
        (lambda: ScriptedDevice({b"S": FASTRAK_STATUS}), "the device 'FASTRAK', firmware 2.10, is no IS-900"),
        (lambda: ScriptedDevice({b"S": StatusRecord().line()}), r"answers neither l\* nor MP"),
        (
            lambda: ScriptedDevice({b"S": StatusRecord().line(), b"l*": b"21l" + b"0" * 32 + b"\r\n"}),
            "no station of the device is active",
        ),
        (
            lambda: ScriptedDevice({b"S": StatusRecord().line(), b"l*": b"21l1" + b"0" * 31 + b"\r\n"}),
            "does not obey its commands",
        ),
    ],
)
def test_other_devices_are_refused(device: Callable[[], Device | None], message: str) -> None:
    bench = Bench(device())
    with pytest.raises(BadInput, match=message) as raised:
        bench.driver(DriverConfig(rate_hz=50.0))
    assert "bench" in str(raised.value)
    assert bench.open_lines == 0
    assert bench.now_s < 1030.0


@pytest.mark.parametrize(
    ("make_config", "message"),
    [
        (lambda: DriverConfig(items=(2, 11, 21, 1)), "has no item 40"),
        (lambda: DriverConfig(stations=("head", "head")), "a name occurs twice"),
        (lambda: DriverConfig(rate_hz=-1.0), "180 Hz"),
        (lambda: DriverConfig(baud=0), "0 baud"),
        (lambda: DriverConfig(quality="best"), "Use 'record' or 'mp'"),  # type: ignore[arg-type]  # the error under test
    ],
)
def test_a_contradictory_configuration_is_refused_at_once(
    make_config: Callable[[], DriverConfig], message: str
) -> None:
    with pytest.raises(BadInput, match=message):
        make_config()
    with pytest.raises(UnknownName, match="no output item called '99'"):
        DriverConfig(items=(40, 99))


def test_a_damaged_reply_or_command_is_repeated() -> None:
    """Configuration succeeds with one damaged reply or command, since both are repeated."""
    for at in range(20, 200, 7):
        bench = bench_of(stations=2)
        count = 0

        def corrupt(data: bytes, at: int = at) -> bytes:
            nonlocal count
            count += len(data)
            return data[:-1] + b"\x00" if count - len(data) <= at < count else data

        bench.corrupt = corrupt
        with bench.driver(DriverConfig(rate_hz=50.0), DriverTiming(answer_s=0.2)) as stream:
            assert len(frames_for(stream, bench, 0.2)) >= 8


def test_an_observer_sees_every_byte_and_the_format_before_data() -> None:
    bench, log = bench_of(stations=2), LineLog()
    with Is900("bench", observer=log, host=bench.host) as stream:
        frames = frames_for(stream, bench, 0.5)
    assert bytes(log.sent_data) == bytes(bench.sent)
    [(received_count, sent_count, wire)] = log.formats
    assert wire == stream.wire
    assert log.sent_data[sent_count - 4 :].startswith(b"MZ\r\nCc")
    assert record_size(wire.items) * 2 * len(frames) <= len(log.received_data) - received_count
    assert [event.kind for event in log.events] == ["connected"]
    assert log.times_s == sorted(log.times_s)
    assert stream.wall_s(log.times_s[0]) == pytest.approx(1.7e9 + log.times_s[0])
