"""Faults: when they strike, what they do, that a seed fixes them, and that scenarios name them well."""

import itertools
from dataclasses import replace
from typing import Any

import pytest

from harness.errors import BadInput, UnknownName
from harness.stream.emulator.config import EmulatorConfig
from harness.stream.emulator.emulator import Emulator
from harness.stream.emulator.faults import Fault, FaultInjector
from harness.stream.emulator.message import SentMessage
from tests.stream.emulator.played import samples

SET_UP = b"O1,40,2,11,21,1\rO2,40,2,11,21,1\rO3,40,2,11,21,1\rO4,40,2,11,21,1\rfuMZ\rC"


def heard(
    *faults: Fault, seed: int = 1, seconds: float = 10.0, step_s: float = 0.02
) -> tuple[Emulator, list[SentMessage]]:
    emulator = Emulator(samples(), EmulatorConfig(faults=faults, seed=seed), 0.0)
    emulator.receive(SET_UP, 0.0)
    sent = [one for k in range(round(seconds / step_s) + 1) for one in emulator.advance(k * step_s)]
    return emulator, sent


BYTE_FAULTS = {kind: Fault(kind, share=0.1) for kind in ("lost", "garbled", "duplicated", "added")}


@pytest.mark.parametrize("kind", BYTE_FAULTS)
def test_a_byte_of_some_records_is_wrong_and_the_log_says_which(kind: str) -> None:
    _, sent = heard(BYTE_FAULTS[kind])
    longer = {"lost": -1, "garbled": 0, "duplicated": 1, "added": 1}[kind]
    hit = [one for one in sent if one.damage]
    assert 0.05 < len(hit) / len(sent) < 0.15
    assert all(one.data == one.message.data and one.sound for one in sent if not one.damage)
    for one in hit:
        assert one.damage == (kind,)
        assert not one.sound
        assert len(one.data) == len(one.message.data) + longer
        assert one.data != one.message.data
    if kind == "duplicated":
        assert all(any(a == b for a, b in zip(one.data, one.data[1:], strict=False)) for one in hit)


def test_the_same_seed_gives_the_same_faults_and_one_more_leaves_the_others() -> None:
    kinds = list(BYTE_FAULTS.values())
    one, again = heard(*kinds)[1], heard(*kinds, step_s=0.5)[1]
    assert [sent.data for sent in one] == [sent.data for sent in again][: len(one)]
    assert [sent.data for sent in one] != [sent.data for sent in heard(*kinds, seed=2)[1]]
    more = heard(*kinds, Fault("burst", at_s=(3.0,), lasts_s=0.1))[1]
    assert [(s.damage, t.damage) for s, t in zip(one, more, strict=True) if s.damage != t.damage] == [
        (s.damage, (*s.damage, "burst")) for s in one if 3.0 <= s.due_s < 3.1
    ]


def test_a_byte_fault_may_have_its_moment() -> None:
    _, sent = heard(Fault("lost", at_s=(2.0, 4.0)))
    assert [round(one.due_s, 1) for one in sent if one.damage] == [2.0, 4.0]


def test_a_stalled_line_drops_the_oldest_and_then_goes_on() -> None:
    emulator, sent = heard(Fault("stall", at_s=(2.0,), lasts_s=1.0))
    assert not [one for one in sent if 2.01 < one.due_s < 3.0]
    assert emulator.line.dropped == pytest.approx(4 * 50 * 1.0 - 12, abs=4)
    times = [one.due_s for one in sent if one.due_s > 3.0]
    assert times[0] == pytest.approx(3.0 + 38 * 10 / 115200)


def test_what_is_sent_to_an_unplugged_line_is_gone() -> None:
    emulator, sent = heard(Fault("disconnect", at_s=(2.0,), lasts_s=1.0))
    assert not [one for one in sent if 2.0 <= one.due_s < 3.0]
    assert emulator.unplugged_messages == pytest.approx(200, abs=2)
    assert len(sent) == pytest.approx(4 * 50 * 9, abs=8)
    unplugged = Emulator(samples(), EmulatorConfig(faults=(Fault("disconnect", at_s=(0.0,), lasts_s=1.0),)), 0.0)
    unplugged.receive(SET_UP, 0.5)
    assert unplugged.unplugged(0.5)
    assert unplugged.advance(2.0) == []
    assert not unplugged.unplugged(1.0)


def test_after_a_reset_the_device_is_polled_and_has_forgotten() -> None:
    emulator, sent = heard(Fault("reset", at_s=(2.0,)))
    assert max(one.due_s for one in sent) < 2.02
    emulator.receive(b"SO1\r", 20.0)
    assert [one.data[:6] for one in emulator.advance(21.0)] == [b"21S3F0", b"21O 2 "]


def test_a_station_out_of_sight_sends_quality_0_and_comes_back() -> None:
    _, sent = heard(Fault("lost_station", station="left_ankle", at_s=(2.0,), lasts_s=1.0))
    out = [one for one in sent if one.data[3] == 0]
    assert {one.message.station for one in out} == {"3"}
    assert len(out) == pytest.approx(50, abs=1)
    assert min(one.due_s for one in out) > 2.0
    assert max(one.due_s for one in out) < 3.02
    assert all(one.sound for one in sent)


def test_another_firmware_knows_no_quality() -> None:
    emulator = Emulator(samples(), EmulatorConfig(faults=(Fault("firmware", firmware="4.1105"),)), 0.0)
    emulator.receive(b"SO1,40,2,4,1\r", 0.0)
    status, refused = (one.data for one in emulator.advance(1.0))
    assert status[15:21] == b"4.1105"
    assert refused.startswith(b"2 E*ERROR*O1,40,2,4,1*ERROR* EC -3")


def test_random_spells_come_as_often_as_asked_and_never_two_at_once() -> None:
    faults = FaultInjector([Fault("stall", per_minute=6.0, lasts_s=2.0)], 1, 100.0)
    spells = faults.pop_started(100.0 + 3600.0)
    assert 60 * 6 * 0.7 < len(spells) < 60 * 6 * 1.0
    assert all(a.to_s <= b.from_s for a, b in itertools.pairwise(spells))
    assert spells[0].from_s > 100.0
    assert faults.next_s > 3700.0


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"kind": "lost"}, "never happens"),
        ({"kind": "lost", "share": 1.5}, "0 to 1"),
        ({"kind": "burst", "at_s": (1.0,)}, "Give lasts_s"),
        ({"kind": "stall", "share": 0.1, "lasts_s": 1.0}, "has no share"),
        ({"kind": "reset", "at_s": (1.0,), "lasts_s": 1.0}, "has no lasts_s"),
        ({"kind": "reset", "at_s": (-1.0,)}, "not negative"),
        ({"kind": "garbled", "share": 0.1, "station": "head"}, "has no station"),
        ({"kind": "firmware", "firmware": "new"}, "such as 4.2301"),
        ({"kind": "firmware"}, "never happens"),
    ],
)
def test_a_fault_that_cannot_be_is_refused(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        Fault(**fields)


def test_a_station_that_nobody_wears_cannot_be_lost() -> None:
    lost = Fault("lost_station", station="tail", at_s=(1.0,), lasts_s=1.0)
    with pytest.raises(UnknownName, match="tail"):
        Emulator(samples(), EmulatorConfig(faults=(lost,)), 0.0)
    assert Emulator(samples(), EmulatorConfig(faults=(replace(lost, station=""),)), 0.0).next_s == 1.0


def test_the_rate_of_the_line_is_the_devices_until_a_restart() -> None:
    emulator = Emulator(samples(), EmulatorConfig(restart_s=0.0), 0.0)
    emulator.receive(b"o96,N,8,0\rS", 0.0)
    emulator.receive(b"\x19S", 1.0)
    slow, fast = emulator.advance(2.0)
    assert slow.due_s == pytest.approx(550 / 9600)
    assert fast.due_s == pytest.approx(1.0 + 550 / 115200)
