"""Trouble on the line, reported once each and overcome; in virtual time, so that silence costs nothing."""

from collections.abc import Callable
from dataclasses import replace
from itertools import islice, pairwise
from typing import Any, get_args

import numpy as np
import pytest

from harness.core.seeds import generator
from harness.experiment.scenarios import load_scenario
from harness.stream.frame import TrackerFrame
from harness.stream.host_clock import HostClockEstimator
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.is900.driver.is900 import Is900
from harness.stream.line_events import LineEvent
from harness.stream.polhemus.codec.commands import station_command
from harness.stream.polhemus.codec.items import SHORT_LIST
from harness.stream.polhemus.codec.reader import ContinuousFrameReader
from harness.stream.polhemus.driver.config import DriverTiming
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.faults import ByteFaultKind, Fault
from tests.stream.is900.driver.bench import (
    START_S,
    Adapter,
    Bench,
    Device,
    EmulatedDevice,
    LineLog,
    bench_of,
    device_of,
    frames_for,
    make_samples,
)

MAX_RECOVERY_S = 2.0
"""Longest time from the device's return to the next frame [s]."""


def assert_times_increase(frames: list[TrackerFrame]) -> None:
    """Check that host times strictly increase and that no station's time steps back."""
    assert all(first.received_s < second.received_s for first, second in pairwise(frames))
    for row in range(len(frames[0].measured_s)):
        stamps_s = np.array([frame.measured_s[row] for frame in frames if not frame.suspect[row]])
        stamps_s = stamps_s[np.isfinite(stamps_s)]
        assert np.all(np.diff(stamps_s) > 0.0)


def gaps_s(frames: list[TrackerFrame]) -> list[float]:
    return [second.received_s - first.received_s for first, second in pairwise(frames)]


def test_a_reset_device_is_configured_again() -> None:
    bench = bench_of(Fault("reset", at_s=(2.0,)))
    with bench.driver() as stream:
        frames = frames_for(stream, bench, 5.0)
        assert bench.kinds == ["connected", "stalled", "reset", "connected"]
        assert "it reports in ASCII" in bench.events[2].text
        assert stream.counts["reconnects"] == 1
        assert device_of(bench).settings.binary
    assert max(gaps_s(frames)) < 0.25 + MAX_RECOVERY_S  # the emulator takes 0.25 s to start
    assert_times_increase(frames)
    offset_s = np.array([frame.received_s - frame.measured_s[-1] for frame in frames])
    assert np.nanmax(offset_s) - np.nanmin(offset_s) < 0.1, "device time continues by the host's clock"
    assert not device_of(bench).streaming


def test_lost_boresight_is_reported_and_not_repeated() -> None:
    bench = bench_of(Fault("reset", at_s=(2.0,)))
    with bench.driver(DriverConfig(boresight=True)) as stream:
        frames_for(stream, bench, 4.0)
    assert bytes(bench.sent).count(b"B1\r\n") == 1
    assert any("boresight is lost" in event.text for event in bench.events)


def test_an_unplugged_line_is_reopened() -> None:
    bench = bench_of()
    with bench.driver() as stream:
        frames = frames_for(stream, bench, 1.0)
        bench.plugged = False
        bench.schedule(20.0, lambda: setattr(bench, "plugged", True))
        frames += frames_for(stream, bench, 22.0)
        assert bench.kinds == ["connected", "unplugged", "connected"]
        assert {port for port, _ in bench.opened} == {"bench"}
    assert 20.0 < max(gaps_s(frames)) < 20.0 + MAX_RECOVERY_S
    assert_times_increase(frames)
    assert bench.open_lines == 0


def test_another_device_at_the_same_port_is_configured_too() -> None:
    bench = bench_of()
    with bench.driver() as stream:
        frames = frames_for(stream, bench, 1.0)
        bench.plugged = False

        def swap() -> None:
            bench.device, bench.plugged = EmulatedDevice(make_samples(4), now_s=bench.now_s), True

        bench.schedule(3.0, swap)
        frames += frames_for(stream, bench, 5.0)
        assert bench.kinds == ["connected", "unplugged", "reset", "connected"]
    assert_times_increase(frames)


class SlowDevice:
    """A device that replies late."""

    def __init__(self, device: Device, delay_s: float) -> None:
        self._device, self._delay_s = device, delay_s
        self._delayed: list[tuple[float, bytes]] = []

    def receive(self, data: bytes, now_s: float) -> None:
        self._device.receive(data, now_s)

    def pop_due(self, now_s: float) -> bytes:
        if data := self._device.pop_due(now_s):
            self._delayed.append((now_s + self._delay_s, data))
        out = b"".join(data for due_s, data in self._delayed if due_s <= now_s)
        self._delayed = [(due_s, data) for due_s, data in self._delayed if due_s > now_s]
        return out

    @property
    def next_s(self) -> float:
        return min([self._device.next_s, *(due_s for due_s, _ in self._delayed)])


def test_a_slow_device_is_reconnected() -> None:
    bench = Bench(SlowDevice(EmulatedDevice(make_samples(2), now_s=1000.0), 0.8))
    with bench.driver() as stream:
        frames_for(stream, bench, 1.0)
        bench.plugged = False
        bench.schedule(3.0, lambda: setattr(bench, "plugged", True))
        frames = frames_for(stream, bench, 20.0)
        assert stream.counts["reconnects"] == 1
        assert frames[-1].received_s > bench.now_s - 0.5


@pytest.mark.parametrize("silence_s", [0.7, 3.0, 20.0])
def test_a_silent_device_is_reconnected(silence_s: float) -> None:
    """The device is off while its line stays open, so commands are lost meanwhile."""
    bench = bench_of()
    with bench.driver() as stream:
        frames = frames_for(stream, bench, 1.0)
        bench.device = None

        def power_on() -> None:
            bench.device = EmulatedDevice(make_samples(4), now_s=bench.now_s)

        bench.schedule(silence_s, power_on)
        frames += frames_for(stream, bench, silence_s + 3.0)
        kinds = ["connected", "stalled", *(["silent"] if silence_s > 2.0 else []), "reset", "connected"]
        assert bench.kinds == kinds
    assert max(gaps_s(frames)) < silence_s + MAX_RECOVERY_S
    assert_times_increase(frames)


def test_a_short_stall_is_reported_without_a_reconnection() -> None:
    bench = bench_of(Fault("stall", at_s=(4.0,), lasts_s=1.2))
    with bench.driver() as stream:
        bench.sent.clear()
        frames = frames_for(stream, bench, 4.0)
        assert bench.kinds == ["connected", "stalled", "connected"]
        assert stream.counts["reconnects"] == 0
        assert bytes(bench.sent).count(b"C") == 1
    assert_times_increase(frames)


def test_a_stopped_clock_is_reported() -> None:
    bench = bench_of()
    device = device_of(bench)
    with bench.driver() as stream:
        frames_for(stream, bench, 1.0)
        stamps_s = device.rounds.player.stamps_s
        device.rounds.player.stamps_s = lambda number: np.zeros_like(stamps_s(number)) + 1.0
        frames_for(stream, bench, 1.0)
        bench.schedule(1.0, lambda: delattr(device.rounds.player, "stamps_s"))
        frames_for(stream, bench, 4.0)
        assert bench.kinds == ["connected", "stalled", "connected"]
        assert "no new record" in bench.events[1].text


@pytest.mark.parametrize("lasts_s", [0.1, 1.0, 4.0])
def test_a_burst_of_garbage_is_reported_once(lasts_s: float) -> None:
    bench = bench_of(Fault("burst", at_s=(2.0,), lasts_s=lasts_s))
    with bench.driver() as stream:
        frames = frames_for(stream, bench, 4.0 + lasts_s)
        assert bench.kinds.count("garbage") == 1
        assert set(bench.kinds) <= {"connected", "garbage", "stalled", "refused"}
        assert len(bench.kinds) == len(set(bench.kinds)) + (lasts_s > 0.5)
        assert (stream.counts["reconnects"] > 0) == (lasts_s > 2.0)
    assert max(gaps_s(frames)) < lasts_s + MAX_RECOVERY_S
    assert_times_increase(frames)


def test_single_damaged_bytes_cause_no_reconnection() -> None:
    kinds: tuple[ByteFaultKind, ...] = get_args(ByteFaultKind)
    bench = bench_of(*(Fault(kind, share=0.01) for kind in kinds))
    with bench.driver() as stream:
        frames = frames_for(stream, bench, 8.0)
        assert stream.counts["reconnects"] == 0
        assert stream.counts["records"] > 0.93 * 8.0 * 50.0 * 4
    assert_times_increase(frames)


def send_from_elsewhere(data: bytes) -> Callable[[Bench], None]:
    return lambda bench: device_of(bench).receive(data, bench.now_s)


@pytest.mark.parametrize(
    ("data", "kind"),
    [
        (b"".join(station_command("O", station, (2, 4, 1)) for station in "1234"), "wrong list"),
        (station_command("O", "3", (40, 2, 11, 21, 22, 1)), "wrong list"),
        (b"F", "reset"),
        (b"F" + b"".join(station_command("O", station, (2, 4, 1)) for station in "1234"), "reset"),
        (b"c", "reset"),
    ],
)
def test_settings_changed_by_another_program_are_restored(data: bytes, kind: str) -> None:
    bench = bench_of()
    with bench.driver() as stream:
        frames = frames_for(stream, bench, 1.0)
        send_from_elsewhere(data)(bench)
        frames += frames_for(stream, bench, 5.0)
        assert bench.kinds.count(kind) == 1
        assert {"connected", kind} <= set(bench.kinds) <= {"connected", "garbage", "stalled", kind}
        assert stream.counts["reconnects"] == 1
        assert len(frames_for(stream, bench, 1.0)) > 40
    assert max(gaps_s(frames)) < MAX_RECOVERY_S + 0.5
    assert_times_increase(frames)


def test_an_unusable_device_is_reported_once_and_tried_again() -> None:
    bench = bench_of()
    with bench.driver() as stream:
        frames_for(stream, bench, 1.0)
        bench.plugged = False

        def replace_device(firmware: str) -> Callable[[], None]:
            def plug() -> None:
                bench.device = EmulatedDevice(make_samples(4), EmulatorConfig(firmware=firmware), bench.now_s)
                bench.plugged = True

            return plug

        bench.schedule(1.0, replace_device("4.1105"))
        bench.schedule(10.0, replace_device("4.2301"))
        assert len(frames_for(stream, bench, 13.0)) > 50
        assert bench.kinds == ["connected", "unplugged", "reset", "refused", "connected"]
        assert "item 40" in bench.events[3].text


def test_a_station_that_is_switched_off_is_invalid_until_it_returns() -> None:
    bench = bench_of()
    with bench.driver() as stream:
        frames_for(stream, bench, 1.0)
        send_from_elsewhere(b"l2,0\r\n")(bench)
        missing = frames_for(stream, bench, 1.0)[-1]
        assert list(missing.position_valid) == [True, False, True, True]
        assert np.isnan(missing.measured_s[1])
        send_from_elsewhere(b"\x19")(bench)
        assert frames_for(stream, bench, 3.0)[-1].position_valid.all()


def test_a_missing_station_is_reported_and_the_others_continue() -> None:
    bench = bench_of()
    with bench.driver() as stream:
        frames_for(stream, bench, 1.0)
        bench.device = EmulatedDevice(make_samples(3), now_s=bench.now_s)
        frames = frames_for(stream, bench, 4.0)
        assert bench.kinds == ["connected", "stalled", "missing", "reset", "connected"]
        assert bench.events[2].text.startswith("station 4 is switched off: its rows are invalid")
        assert stream.stations == ("1", "2", "3", "4")
    assert list(frames[-1].position_valid) == [True, True, True, False]
    assert_times_increase(frames)


def test_bytes_delayed_by_an_adapter_split_no_frame() -> None:
    device = EmulatedDevice(make_samples(4, 120.0), now_s=1000.0)
    bench = Bench(Adapter(device))
    with bench.driver(DriverConfig(items=SHORT_LIST)) as stream:
        frames = frames_for(stream, bench, 4.0)
    assert len(frames) > 4 * 118
    assert all(frame.position_valid.all() for frame in frames)
    assert not any(frame.suspect.any() for frame in frames)


def test_a_lost_station_shows_in_item_40() -> None:
    bench = bench_of(Fault("lost_station", at_s=(3.0,), lasts_s=1.0, station="torso"))
    with bench.driver() as stream:
        frames = frames_for(stream, bench, 3.0)
    is_lost = [not frame.position_valid[1] for frame in frames]
    assert 45 <= sum(is_lost) <= 55
    assert all(frame.position_valid[[0, 2, 3]].all() for frame in frames)


def test_a_lost_station_shows_by_mp_without_item_40() -> None:
    bench = bench_of(Fault("lost_station", at_s=(3.0,), lasts_s=5.0, station="torso"), firmware="3.1102")
    with bench.driver(DriverConfig(quality="mp")) as stream:
        assert stream.wire.items == (2, 11, 21, 1)
        frames = frames_for(stream, bench, 12.0)
    assert 10 <= bytes(bench.sent).count(b"MP\r\n") <= 14
    is_lost = [not frame.position_valid[1] for frame in frames]
    assert 190 <= sum(is_lost) <= 310
    assert all(frame.position_valid[[0, 2, 3]].all() for frame in frames)
    assert bench.kinds == ["connected"]


def test_the_clock_is_zeroed_periodically_and_no_frame_steps_back() -> None:
    """Two and a half hours of a slow device: the stamps stay exact, and device time continues."""
    bench = bench_of(stations=2, rate_hz=0.1)
    with bench.driver(DriverConfig(rate_hz=0.1), DriverTiming(stalled_s=30.0, silent_s=60.0, poll_s=10.0)) as stream:
        frames = frames_for(stream, bench, 9000.0)
        assert bytes(bench.sent).count(b"MZ\r\n") == 1 + 2
        assert bench.kinds == ["connected"]
        assert stream.counts["clock_resets"] == 2
    assert len(frames) > 880
    assert_times_increase(frames)
    assert sum(bool(frame.suspect.any()) for frame in frames) <= 4
    offset_s = np.array([f.received_s - f.measured_s[-1] for f in frames if not f.suspect.any()])
    assert np.nanmax(offset_s) - np.nanmin(offset_s) < 0.1


def test_the_clock_can_be_zeroed_often_at_full_rate() -> None:
    bench = bench_of(rate_hz=75.0)
    with bench.driver(timing=DriverTiming(rezero_s=2.0)) as stream:
        frames = frames_for(stream, bench, 9.0)
        assert stream.counts["clock_resets"] == 4
        assert bench.kinds == ["connected"]
    assert len(frames) > 74 * 9
    assert_times_increase(frames)
    assert sum(bool(frame.suspect.any()) for frame in frames) <= 8


def test_the_observed_bytes_give_the_same_frames() -> None:
    faults = (
        Fault("reset", at_s=(4.0, 9.0)),
        Fault("garbled", share=0.005),
        Fault("burst", at_s=(6.0,), lasts_s=0.7),
        Fault("stall", at_s=(12.0,), lasts_s=1.0),
    )
    bench = bench_of(*faults)
    reader, replayed = ContinuousFrameReader(), list[TrackerFrame]()

    class ReplayObserver(LineLog):
        def on_received(self, data: bytes, monotonic_s: float, wall_s: float) -> None:
            replayed.extend(reader.feed(data, monotonic_s) if data else reader.expire(monotonic_s))

        def on_configured(self, wire: Any) -> None:
            replayed.extend(reader.begin_session(wire, bench.now_s))

    with Is900("bench", observer=ReplayObserver(), host=bench.host) as stream:
        frames = frames_for(stream, bench, 16.0)
        assert stream.counts["reconnects"] >= 2
    assert len(frames) > 600
    for first, second in zip(frames, replayed, strict=False):
        assert first.received_s == second.received_s
        np.testing.assert_array_equal(first.measured_s, second.measured_s)
        np.testing.assert_array_equal(first.position_m, second.position_m)


def test_health_reports_rate_and_counts() -> None:
    bench = bench_of(Fault("garbled", share=0.05))
    with bench.driver() as stream:
        frames_for(stream, bench, 4.0)
        health = stream.health()
    assert health["rate_hz"] == pytest.approx(50.0, rel=0.05)
    assert health["records"] > 700
    assert health["garbage_bytes"] > 0
    assert health["reconnects"] == 0
    assert 0.0 <= health["silent_s"] < 0.1


def test_no_rate_is_told_before_it_is_known() -> None:
    """The computer is busy at first, so the first read finds twelve frames: they give no rate, and later ones do."""
    bench = bench_of()
    held = bytearray()
    with bench.driver() as stream:
        free_s = bench.now_s + 0.25

        def hold(data: bytes) -> bytes:
            held.extend(data)
            out = bytes(held) if bench.now_s >= free_s else b""
            del held[: len(out)]
            return out

        bench.corrupt = hold
        told_hz = [stream.health().get("rate_hz") for _ in islice(stream, 100)]
    assert told_hz[:10] == [None] * 10
    rates_hz = [rate_hz for rate_hz in told_hz if rate_hz is not None]
    assert len(rates_hz) > 50
    assert np.abs(np.array(rates_hz) - 50.0).max() < 10.0


@pytest.mark.slow
def test_times_strictly_increase_in_three_minutes_of_faults() -> None:
    """All faults of the emulator, at random, behind an adapter that holds bytes back."""
    scenario = load_scenario("emulator_faults")
    faults = tuple(replace(fault, station="torso") if fault.station else fault for fault in scenario.fault)
    device = EmulatedDevice(make_samples(4, 40.0), EmulatorConfig(faults=faults, seed=1), START_S)
    bench = Bench(Adapter(device))
    host_clock, host_s = HostClockEstimator(), [0.0]
    latest_s, unstamped, frames = np.full(4, -np.inf), 0, 0
    with bench.driver() as stream:
        for frame in frames_for(stream, bench, 180.0):
            stamped = ~np.isnan(frame.measured_s)
            assert (frame.measured_s[stamped] > latest_s.max()).all()
            latest_s[stamped] = frame.measured_s[stamped]
            host_s.append(host_clock.measured_s(frame))
            assert host_s[-1] > host_s[-2]
            assert (frame.suspect | stamped | ~frame.position_valid).all()
            unstamped += int((frame.suspect & ~stamped).sum())
            frames += 1
        assert stream.counts["reconnects"] >= 1
    assert frames > 6900
    repeated = sum(4 * frames * fault.share for fault in faults if fault.kind == "repeated")  # has no time of its own
    assert 0.5 * repeated < unstamped < 100 + 1.2 * repeated, "damaged stamps cost more than themselves"


@pytest.mark.slow
def test_an_hour_of_random_trouble_is_overcome() -> None:
    """Unplugging, resets, noise and random commands: the driver always reconnects, and times increase."""
    rng = generator(1, "an hour of trouble")
    bench = bench_of(stations=3, rate_hz=10.0)
    events: list[LineEvent] = bench.events
    with bench.driver() as stream:
        for _ in range(120):
            match rng.integers(4):
                case 0:
                    bench.plugged = False
                    bench.schedule(float(rng.exponential(5.0)), lambda: setattr(bench, "plugged", True))
                case 1:
                    device_of(bench).receive(b"\x19", bench.now_s)
                case 2:
                    noise = rng.bytes(200)
                    bench.corrupt = lambda data, noise=noise: noise[: len(data)]  # type: ignore[misc]  # the default binds it
                    bench.schedule(float(rng.exponential(2.0)), lambda: setattr(bench, "spoil", lambda data: data))
                case _:
                    device_of(bench).receive(rng.bytes(30), bench.now_s)
            frames = frames_for(stream, bench, 30.0)
            assert len(frames) > 20
            assert_times_increase(frames)
            assert frames[-1].received_s > bench.now_s - 1.0
    assert len(events) > 120
    assert bench.open_lines == 0
