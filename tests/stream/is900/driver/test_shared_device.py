"""A device that another program has used before: its settings do not change this session, and it gets them back."""

import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np
import pytest

from harness.core import rotations
from harness.errors import BadInput
from harness.stream.frame import TrackerFrame
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.is900.driver.session_settings import STATION_SETTINGS
from harness.stream.polhemus.codec.records import from_yaw_pitch_roll_deg, yaw_pitch_roll_deg
from harness.stream.polhemus.codec.replies import parse_reply
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.faults import Fault
from tests.stream.is900.driver.bench import LOOP_S, START_S, Bench, EmulatedDevice, frames_for, make_samples

STATIONS = 2
TURNED_S = 161.0 / 360.0 * LOOP_S
"""The stations turn about Z once in a loop, so their heading is 161 deg now [s]."""
QUERIES = b"".join(b"O%c\rA%c\rN%c\rG%c\rH%c\rMp%c\rMQ%c\rMs%c\r" % ((s,) * 8) for s in b"12") + b"MS\rl*\rS"
SHARED = {
    "tip offset": (b"N1,30,0,0\rN2,30,0,0\r", 0.3, 0.0),
    "boresight": (b"B1\rB2\r", 0.0, 161.0),
    "alignment": (b"A1,680,0,0,880,0,0,680,200,0\rA2,680,0,0,880,0,0,680,200,0\r", 6.8, 0.0),
    "boresight reference angles": (b"G1,90,0,0\rG2,90,0,0\rB1\rB2\r", 0.0, 71.0),
}
"""What another program sent, and how far the readings are then off [m, deg]."""


def shared_bench(left: bytes, config: EmulatorConfig | None = None) -> Bench:
    """A device that runs for 4.5 s before another program sends its last commands."""
    bench = Bench(EmulatedDevice(make_samples(STATIONS), config, START_S))
    bench.sleep(TURNED_S)
    send(bench, left)
    return bench


def send(bench: Bench, data: bytes) -> bytes:
    """Send bytes from another program, and return the device's reply."""
    assert bench.device is not None
    bench.device.receive(data, bench.now_s)
    bench.sleep(1.0)
    return bench.device.pop_due(bench.now_s)


def errors(frames: list[TrackerFrame]) -> tuple[float, float]:
    """Greatest error of a position [m] and of an orientation [deg] of station 1, about the device's own motion."""
    samples, far_m, turned_deg = make_samples(STATIONS), 0.0, 0.0
    assert len(frames) > 20
    for frame in frames:
        k = round(frame.measured_s[0] * samples.rate_hz) % len(samples)
        far_m = max(far_m, float(np.linalg.norm(frame.position_m[0] - samples.position_m[k, 0])))
        angle = rotations.angle_between_rad(frame.tracker_from_station[0], samples.tracker_from_station[k, 0])
        turned_deg = max(turned_deg, float(np.rad2deg(angle)))
    return far_m, turned_deg


@pytest.mark.parametrize("name", SHARED)
def test_a_session_does_not_see_what_another_program_left(name: str) -> None:
    left, _, _ = SHARED[name]
    bench = shared_bench(left)
    before = send(bench, QUERIES)
    with bench.driver() as stream:
        far_m, turned_deg = errors(frames_for(stream, bench, 1.0))
        assert "boresight of station 1, 2 undone" in stream.setup_note
    assert far_m < 1e-4
    assert turned_deg < 0.01
    texts = [event.text for event in bench.events if event.kind == "settings"]
    if name == "boresight":  # the device cannot tell, so there is nothing to report beyond the note
        assert texts == []
    else:
        assert name in texts[0]
        assert "(station 1, 2); at defaults for this session, then put back" in texts[0]
        assert texts[1].startswith("put back: ")
    assert send(bench, QUERIES) == before


@pytest.mark.parametrize("name", SHARED)
def test_kept_settings_change_the_readings_and_are_reported(name: str) -> None:
    left, off_m, off_deg = SHARED[name]
    bench = shared_bench(left)
    before = send(bench, QUERIES)
    with bench.driver(DriverConfig(keep_settings=True)) as stream:
        far_m, turned_deg = errors(frames_for(stream, bench, 1.0))
        assert "kept" in stream.setup_note
    assert far_m == pytest.approx(off_m, abs=0.01)
    assert turned_deg == pytest.approx(off_deg, abs=0.5)
    texts = [event.text for event in bench.events if event.kind == "settings"]
    assert len(texts) == (name != "boresight")
    assert all(name in text and text.endswith("; kept, as asked") for text in texts)
    assert send(bench, QUERIES) == before
    settings = bench.device.emulator.device.settings if isinstance(bench.device, EmulatedDevice) else None
    assert settings is not None
    assert settings.stations[0].plain == (off_m == off_deg == 0.0)


def test_filters_units_and_lists_are_reported_and_put_back() -> None:
    left = b"uf\rMt\rMBF\rO1,2,11,0\rO2,2,4,22,1\rMp1,40\rMQ2,5\rMF1,2\rMF2,2\rG1,10,20,30\rH1,0,0,1\r"
    bench = shared_bench(left)
    before = send(bench, QUERIES)
    with bench.driver(DriverConfig(centimetres=False)) as stream:
        assert errors(frames_for(stream, bench, 1.0)) < (1e-4, 0.01)
        during = settings_of(bench)
        assert [(s.prediction_ms, s.sensitivity, s.enhancement) for s in during.stations[:2]] == [(0, 3, 0)] * 2
        assert not during.boresight_as_fastrak
    for text in (
        "prediction Mp 40 ms (station 1)",
        "sensitivity MQ 5 (station 2)",
        "enhancement MF 2 (station 1, 2)",
        "boresight reference angles G 10, 20, 30 deg (station 1)",
        "centimetres; microseconds; boresight as on a Fastrak",
    ):
        assert text in bench.events[0].text
    assert send(bench, QUERIES) == before


def test_a_unit_at_its_defaults_is_no_reason_for_a_report() -> None:
    bench = shared_bench(b"")
    assert b"21H   1.00   0.00   0.00\r\n" in send(bench, QUERIES), "the default of a Fastrak"
    with bench.driver() as stream:
        frames_for(stream, bench, 0.5)
    assert [event.text for event in bench.events if event.kind == "settings"] == []
    assert b"H1" not in bench.sent.replace(b"MH1", b""), "the hemisphere vector is neither read nor written"
    assert not re.search(rb"G\d,", bytes(bench.sent))


@pytest.mark.parametrize("keep", [False, True])
def test_boresight_of_a_session_gives_the_heading_of_the_reference_angles(keep: bool) -> None:
    """`B` makes the heading that of `G`; pitch and roll stay (docs/is900.md 4.1). A session has `G` at 0, 0, 0."""
    still = np.broadcast_to(from_yaw_pitch_roll_deg(np.array([[161.0, -20.0, 10.0]])), (500, STATIONS, 4))
    samples = replace(make_samples(STATIONS), tracker_from_station=still)
    bench = Bench(EmulatedDevice(samples, None, START_S))
    send(bench, b"G1,90,5,5\rG2,90,5,5\r")
    before = send(bench, QUERIES)
    with bench.driver(DriverConfig(boresight=True, keep_settings=keep)) as stream:
        frames = frames_for(stream, bench, 0.5)
    for frame in frames:
        angles_deg = yaw_pitch_roll_deg(frame.tracker_from_station)
        np.testing.assert_allclose(angles_deg, [[90.0 if keep else 0.0, -20.0, 10.0]] * STATIONS, atol=1e-3)
    assert len(frames) > 10
    assert send(bench, QUERIES) == before


def settings_of(bench: Bench) -> Any:
    assert isinstance(bench.device, EmulatedDevice)
    return bench.device.emulator.device.settings


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_settings_are_put_back_after_ctrl_c_and_after_an_error(error: type[BaseException]) -> None:
    bench = shared_bench(SHARED["tip offset"][0] + b"Mp2,40\r")
    before = send(bench, QUERIES)

    def read() -> Iterator[TrackerFrame]:
        with bench.driver() as stream:
            yield from islice(stream, 5)
            raise error

    with pytest.raises(error):
        list(read())
    assert send(bench, QUERIES) == before


def test_a_second_ctrl_c_does_not_keep_the_settings() -> None:
    """It comes in the middle of the commands that put settings back."""
    bench = shared_bench(SHARED["tip offset"][0])
    before, stream = send(bench, QUERIES), bench.driver()
    list(islice(stream, 5))
    assert bench.device is not None
    pressed: list[float] = []
    receive = bench.device.receive

    def interrupted(data: bytes, now_s: float) -> None:
        receive(data, now_s)
        if data.startswith(b"N1,") and not pressed:
            pressed.append(now_s)
            raise KeyboardInterrupt

    bench.device.receive = interrupted  # type: ignore[method-assign]  # a person who presses the keys at that moment
    with pytest.raises(KeyboardInterrupt):
        stream.close()
    assert pressed
    assert send(bench, QUERIES) == before
    assert bench.open_lines == 0


def test_a_device_that_restarts_with_saved_settings_gets_its_defaults_again() -> None:
    """The alignment was saved and then undone, so it is back after the restart only."""
    config = EmulatorConfig(faults=(Fault("reset", at_s=(12.0,)),))
    bench = shared_bench(SHARED["alignment"][0] + b"\x0bR1\rR2\r", config)
    with bench.driver() as stream:
        frames = frames_for(stream, bench, 12.0)
        assert stream.counts["reconnects"] == 1
        zero_s = frames[-1].measured_s[0]
    assert zero_s > 0.0
    assert max(float(np.linalg.norm(frame.position_m[0])) for frame in frames) < 1.01  # true: always 1 m away


def test_an_alignment_of_the_session_ends_with_it() -> None:
    """Boresight and alignment that the session asked for do not disturb the next program."""
    bench = shared_bench(b"")
    before = send(bench, QUERIES)
    frame = ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0))
    with bench.driver(DriverConfig(alignment=frame, boresight=True)) as stream:
        assert errors(frames_for(stream, bench, 0.5))[0] > 1.0
    assert send(bench, QUERIES) == before
    assert all(station.plain for station in settings_of(bench).stations)


def test_a_line_that_is_gone_is_told() -> None:
    bench = shared_bench(SHARED["tip offset"][0])
    stream = bench.driver()
    list(islice(stream, 5))
    bench.plugged = False
    stream.close()
    assert bench.events[-1].text.startswith("not put back, the device is gone: tip offset N 30, 0, 0 cm")


def test_a_device_that_keeps_its_settings_is_refused() -> None:
    bench = shared_bench(SHARED["tip offset"][0])
    assert bench.device is not None
    receive = bench.device.receive
    bench.device.receive = lambda data, now_s: receive(data.replace(b"N1,0.", b"V1,0."), now_s)  # type: ignore[method-assign]  # a locked device
    with pytest.raises(BadInput, match=r"station 1 keeps tip offset N 30, 0, 0 cm.*--keep-settings"):
        bench.driver()
    assert bench.open_lines == 0


def test_what_cannot_be_read_is_set_and_told() -> None:
    bench = shared_bench(SHARED["tip offset"][0])
    bench.corrupt = lambda data: data.replace(b"21N", b"21@")
    with bench.driver() as stream:
        far_m, _ = errors(frames_for(stream, bench, 1.0))
        assert "nor can tip offset N, now at their defaults" in stream.setup_note
    assert far_m < 1e-4
    assert bench.sent.count(b"N1\r\n") == 2, "a damaged reply is asked for again"
    assert bench.sent.count(b"N2\r\n") == 0, "a query without an answer costs a second, once"


@pytest.mark.parametrize(
    ("values", "is_default"),
    [
        ((0, 0, 0, 1, 0, 0, 0, 500, 0), True),
        ((0, 0, 0, 200, 0, 0, 7, 200, 0), True),
        ((1, 0, 0, 201, 0, 0, 1, 200, 0), False),
        ((0, 0, 0, 0, 200, 0, -200, 0, 0), False),
        ((0, 0, 0, 200, 0, 0, 0, -200, 0), False),
        ((0, 0, 0, 0, 0, 0, 0, 0, 0), False),
    ],
)
def test_alignments_are_compared_by_their_effect(values: tuple[float, ...], is_default: bool) -> None:
    assert STATION_SETTINGS[0].is_default(values) == is_default


def test_every_setting_is_read_and_set_as_the_device_has_it() -> None:
    device = EmulatedDevice(make_samples(1), None, START_S).emulator.device
    assert len({setting.name for setting in STATION_SETTINGS}) == 6
    for setting in STATION_SETTINGS:
        device.receive(setting.query_command("1"), START_S)
        (message,) = device.messages(START_S)
        values = setting.values_of(parse_reply(message.data), "1")
        assert values is not None
        assert setting.is_default(values), setting.name
        assert setting.values_of(parse_reply(message.data), "2") is None
