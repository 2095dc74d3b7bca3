"""Faults: when they occur, what they do, that a seed fixes them, and that scenarios name them correctly."""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from harness.errors import BadInput, UnknownName
from harness.stream.is900.emulator.emulator import Emulator
from harness.stream.polhemus.codec.reader import ByteCapture
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.device_state import SentMessage
from harness.stream.polhemus.emulator.faults import Fault, FaultInjector, add_byte_faults, unapplied_kinds
from tests.stream.is900.emulator.played import make_samples

SET_UP = b"O1,40,2,11,21,1\rO2,40,2,11,21,1\rO3,40,2,11,21,1\rO4,40,2,11,21,1\rfuMZ\rC"


def run_emulator(
    *faults: Fault, seed: int = 1, seconds: float = 10.0, step_s: float = 0.02
) -> tuple[Emulator, list[SentMessage]]:
    emulator = Emulator(make_samples(), EmulatorConfig(faults=faults, seed=seed), 0.0)
    emulator.receive(SET_UP, 0.0)
    sent = [message for k in range(round(seconds / step_s) + 1) for message in emulator.advance(k * step_s)]
    return emulator, sent


BYTE_FAULTS = {kind: Fault(kind, share=0.1) for kind in ("lost", "garbled", "duplicated", "added", "repeated")}


@pytest.mark.parametrize("kind", BYTE_FAULTS)
def test_byte_faults_change_a_share_of_the_messages_and_are_logged(kind: str) -> None:
    _, sent = run_emulator(BYTE_FAULTS[kind])
    extra_bytes = {"lost": -1, "garbled": 0, "duplicated": 1, "added": 1}
    damaged = [message for message in sent if message.damage]
    assert 0.05 < len(damaged) / len(sent) < 0.15
    assert all(message.data == message.message.data and message.sound for message in sent if not message.damage)
    for message in damaged:
        assert message.damage == (kind,)
        assert not message.sound
        more = len(message.message.data) if kind == "repeated" else extra_bytes[kind]
        assert len(message.data) == len(message.message.data) + more
        assert message.data != message.message.data
    if kind == "repeated":
        assert all(message.data == 2 * message.message.data for message in damaged)
    if kind == "duplicated":
        assert all(any(a == b for a, b in zip(message.data, message.data[1:], strict=False)) for message in damaged)


def test_a_seed_fixes_the_faults_and_one_more_leaves_the_others() -> None:
    kinds = list(BYTE_FAULTS.values())
    first_run, second_run = run_emulator(*kinds)[1], run_emulator(*kinds, step_s=0.5)[1]
    assert [sent.data for sent in first_run] == [sent.data for sent in second_run][: len(first_run)]
    assert [sent.data for sent in first_run] != [sent.data for sent in run_emulator(*kinds, seed=2)[1]]
    third_run = run_emulator(*kinds, Fault("burst", at_s=(3.0,), lasts_s=0.1))[1]
    assert [(s.damage, t.damage) for s, t in zip(first_run, third_run, strict=True) if s.damage != t.damage] == [
        (s.damage, (*s.damage, "burst")) for s in first_run if 3.0 <= s.due_s < 3.1
    ]


def test_a_byte_fault_may_have_fixed_times() -> None:
    _, sent = run_emulator(Fault("lost", at_s=(2.0, 4.0)))
    assert [round(message.due_s, 1) for message in sent if message.damage] == [2.0, 4.0]


def test_a_stalled_line_drops_the_oldest_and_then_continues() -> None:
    emulator, sent = run_emulator(Fault("stall", at_s=(2.0,), lasts_s=1.0))
    assert not [message for message in sent if 2.01 < message.due_s < 3.0]
    assert emulator.line.dropped == pytest.approx(4 * 50 * 1.0 - 12, abs=4)
    times = [message.due_s for message in sent if message.due_s > 3.0]
    assert times[0] == pytest.approx(3.0 + 38 * 10 / 115200)


def test_messages_of_an_unplugged_line_are_lost() -> None:
    emulator, sent = run_emulator(Fault("disconnect", at_s=(2.0,), lasts_s=1.0))
    assert not [message for message in sent if 2.0 <= message.due_s < 3.0]
    assert emulator.unplugged_messages == pytest.approx(200, abs=2)
    assert len(sent) == pytest.approx(4 * 50 * 9, abs=8)
    unplugged = Emulator(make_samples(), EmulatorConfig(faults=(Fault("disconnect", at_s=(0.0,), lasts_s=1.0),)), 0.0)
    unplugged.receive(SET_UP, 0.5)
    assert unplugged.unplugged(0.5)
    assert unplugged.advance(2.0) == []
    assert not unplugged.unplugged(1.0)


def test_after_a_reset_the_device_is_polled_with_default_settings() -> None:
    emulator, sent = run_emulator(Fault("reset", at_s=(2.0,)))
    assert max(message.due_s for message in sent) < 2.02
    emulator.receive(b"SO1\r", 20.0)
    assert [message.data[:6] for message in emulator.advance(21.0)] == [b"21S3F0", b"21O 2 "]


def test_a_lost_station_sends_quality_0_until_it_returns() -> None:
    _, sent = run_emulator(Fault("lost_station", station="left_ankle", at_s=(2.0,), lasts_s=1.0))
    lost_records = [message for message in sent if message.data[3] == 0]
    assert {message.message.station for message in lost_records} == {"3"}
    assert len(lost_records) == pytest.approx(50, abs=1)
    assert min(message.due_s for message in lost_records) > 2.0
    assert max(message.due_s for message in lost_records) < 3.02
    assert all(message.sound for message in sent)


def test_older_firmware_has_no_quality() -> None:
    emulator = Emulator(make_samples(), EmulatorConfig(faults=(Fault("firmware", firmware="4.1105"),)), 0.0)
    emulator.receive(b"SO1,40,2,4,1\r", 0.0)
    status, rejection = (message.data for message in emulator.advance(1.0))
    assert status[15:21] == b"4.1105"
    assert rejection.startswith(b"2 E*ERROR*O1,40,2,4,1*ERROR* EC -3")


def test_random_episodes_have_their_rate_and_never_overlap() -> None:
    injector = FaultInjector([Fault("stall", per_minute=6.0, lasts_s=2.0)], 1, 100.0)
    episodes = injector.pop_started(100.0 + 3600.0)
    assert 60 * 6 * 0.7 < len(episodes) < 60 * 6 * 1.0
    assert all(a.to_s <= b.from_s for a, b in itertools.pairwise(episodes))
    assert episodes[0].from_s > 100.0
    assert injector.next_s > 3700.0


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"kind": "lost"}, "never happens"),
        ({"kind": "lost", "share": 1.5}, "0 to 1"),
        ({"kind": "burst", "at_s": (1.0,)}, "Give lasts_s"),
        ({"kind": "stall", "share": 0.1, "lasts_s": 1.0}, "has no share"),
        ({"kind": "reset", "at_s": (1.0,), "lasts_s": 1.0}, "has no lasts_s"),
        ({"kind": "reset", "at_s": (-1.0,)}, "Give a number from 0"),
        ({"kind": "garbled", "share": 0.1, "station": "head"}, "has no station"),
        ({"kind": "firmware", "firmware": "new"}, "such as 4.2301"),
        ({"kind": "firmware"}, "never happens"),
    ],
)
def test_an_impossible_fault_is_refused(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        Fault(**fields)


def test_a_fault_of_an_unknown_station_is_refused() -> None:
    fault = Fault("lost_station", station="tail", at_s=(1.0,), lasts_s=1.0)
    with pytest.raises(UnknownName, match="tail"):
        Emulator(make_samples(), EmulatorConfig(faults=(fault,)), 0.0)
    assert Emulator(make_samples(), EmulatorConfig(faults=(replace(fault, station=""),)), 0.0).next_s == 1.0


def test_the_baud_rate_is_set_until_a_restart() -> None:
    emulator = Emulator(make_samples(), EmulatorConfig(restart_s=0.0), 0.0)
    emulator.receive(b"o96,N,8,0\rS", 0.0)
    emulator.receive(b"\x19S", 1.0)
    slow_message, fast_message = emulator.advance(2.0)
    assert slow_message.due_s == pytest.approx(550 / 9600)
    assert fast_message.due_s == pytest.approx(1.0 + 550 / 115200)


RECORDS = [f"record {i:04d}\r\n".encode() for i in range(2000)]
CAPTURE = ByteCapture(
    b"".join(RECORDS), np.cumsum([len(record) for record in RECORDS]), 0.01 * np.arange(2000, dtype=float)
)


def chunks(capture: ByteCapture) -> list[bytes]:
    ends = capture.ends.tolist()
    return [capture.data[begin:end] for begin, end in zip([0, *ends], ends, strict=False)]


def test_repeated_records_are_sent_twice() -> None:
    found = chunks(add_byte_faults(CAPTURE, [Fault("repeated", share=0.05)], 1))
    twice = [one == record + record for one, record in zip(found, RECORDS, strict=True)]
    assert all(one == record or again for one, record, again in zip(found, RECORDS, twice, strict=True))
    assert 70 < sum(twice) < 130


def test_the_seed_decides_and_other_faults_change_nothing() -> None:
    fault = Fault("repeated", share=0.05)
    assert add_byte_faults(CAPTURE, [fault], 1).data == add_byte_faults(CAPTURE, [fault], 1).data
    assert add_byte_faults(CAPTURE, [fault], 1).data != add_byte_faults(CAPTURE, [fault], 2).data
    stall = Fault("stall", at_s=(1.0,), lasts_s=0.5)
    assert add_byte_faults(CAPTURE, [stall], 1) is CAPTURE
    assert unapplied_kinds([fault, stall, Fault("firmware", firmware="4.1105")]) == ["firmware", "stall"]
    assert add_byte_faults(CAPTURE, [fault, stall], 1).data == add_byte_faults(CAPTURE, [fault], 1).data
