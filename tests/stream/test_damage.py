"""Damaged bytes in all formats: what they cost, what is marked, and that memory is bounded and nothing is invented.

`make test-slow` tries a million. `test_many_fates` then prints the table of docs/notes/damage.md.
"""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from harness.stream.polhemus.codec.decoder import LONGEST_REPLY, DecoderEvent, Garbage, RecordRun, merge_adjacent
from tests.stream.damage import (
    FATES,
    KINDS,
    LISTS,
    Fate,
    Kind,
    count_lost,
    damage,
    decoded_records,
    fate_of_damage,
    fate_of_wrong_station,
    make_capture,
)


def _count_costs(name: str, kind: Kind, trials: int) -> Counter[tuple[int, int]]:
    return Counter(count_lost(name, kind, trial) for trial in range(trials))


def _check_costs(costs: Counter[tuple[int, int]], trials: int, case: object) -> None:
    """Check that at most one further record is lost, except in one trial in a thousand, and nothing is invented."""
    multiple_losses = sum(count for (missing, _), count in costs.items() if missing > 1)
    invented = sum(count for (_, extra), count in costs.items() if extra > 0)
    assert multiple_losses <= trials / 1000, (case, costs)
    assert invented <= trials / 1000, (case, costs)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", LISTS)
def test_a_damaged_byte_costs_its_record_and_at_most_one_other(name: str, kind: Kind) -> None:
    _check_costs(_count_costs(name, kind, 200), 200, name)


@pytest.mark.slow
def test_a_million_damaged_bytes_cost_their_records_and_at_most_one_other_each() -> None:
    trials = 1_000_000 // (len(LISTS) * len(KINDS)) + 1
    for name in LISTS:
        for kind in KINDS:
            costs = _count_costs(name, kind, trials)
            print(f"{name:16} {kind:8} {trials} trials; further records lost: {_by_missing(costs)}", flush=True)
            _check_costs(costs, trials, (name, kind))


def _by_missing(costs: Counter[tuple[int, int]]) -> dict[int, int]:
    out: Counter[int] = Counter()
    for (missing, _), count in costs.items():
        out[max(missing, 0)] += count
    return dict(sorted(out.items()))


@pytest.mark.parametrize("name", LISTS)
def test_most_damage_is_detected(name: str) -> None:
    """A lost or added byte is always noticed, and so are most changes of numbers in ASCII."""
    trials = 40
    shares = _fates(name, trials)
    for kind, fate_counts in shares.items():
        wrong = fate_counts["large"] + fate_counts["small"]
        if kind in ("lost", "added"):
            assert fate_counts["large"] <= 1, shares
        else:
            assert wrong <= (0.4 if name.startswith("ASCII") else 0.8) * trials, shares


@pytest.mark.parametrize("name", LISTS)
def test_a_wrong_station_is_always_marked(name: str) -> None:
    """A station's character is changed to another's, in every list: sequence and time reveal it."""
    for trial in range(30):
        assert fate_of_wrong_station(name, trial) in ("suspect", "missing"), trial


@pytest.mark.slow
def test_many_fates() -> None:
    trials = 2000
    print(f"\n| List | Damage | {' | '.join(FATES)} |")
    for name in LISTS:
        for kind, fate_counts in _fates(name, trials).items():
            print(
                f"| {name} | {kind} | " + " | ".join(f"{fate_counts[f] / trials:.1%}" for f in FATES) + " |", flush=True
            )
            assert kind in ("flipped", "changed") or fate_counts["large"] < trials / 500


def _fates(name: str, trials: int) -> dict[Kind, Counter[Fate]]:
    return {kind: Counter(fate_of_damage(name, kind, trial) for trial in range(trials)) for kind in KINDS}


@pytest.mark.parametrize("name", LISTS)
def test_every_split_gives_the_same_events(name: str, rng: np.random.Generator) -> None:
    """With records, replies between them, garbage and a damaged byte."""
    capture = make_capture(name, 3, 3)
    parts = [b"\x00noise01 0", *capture.records]
    parts.insert(4, b"31PT81L00X00X00X00X00X00X00X00X00X00X00  120  \r\n")
    parts.insert(9, b"2 E*ERROR*x*ERROR* EC -99*PS1  *FL1 *ST0\r\n21O 2 4 1\r\n")
    parts.insert(12, b"\xff2 ")
    data = bytearray(b"".join(parts))
    data[11 * capture.size + 5] ^= 0x11
    expected = _decode_split(name, bytes(data), ())
    assert sum(isinstance(event, tuple) for event in expected) >= 1
    for cut in range(1, len(data)):
        assert _decode_split(name, bytes(data), (cut,)) == expected, cut
    for _ in range(50):
        cuts = tuple(sorted(rng.integers(0, len(data), 9).tolist()))
        assert _decode_split(name, bytes(data), cuts) == expected, cuts
    assert _decode_split(name, bytes(data), tuple(range(1, len(data)))) == expected


def _decode_split(name: str, data: bytes, cuts: tuple[int, ...]) -> list[object]:
    decoder = make_capture(name, 3, 3).decoder()
    events: list[DecoderEvent] = []
    for start, stop in zip((0, *cuts), (*cuts, len(data)), strict=True):
        events += decoder.feed(data[start:stop])
    out = merge_adjacent(events + decoder.finish())
    return [(e.offset, e.size, e.table.tobytes()) if isinstance(e, RecordRun) else e for e in out]


@pytest.mark.parametrize("name", LISTS)
def test_an_undamaged_stream_is_complete_and_replies_are_separated(name: str) -> None:
    capture = make_capture(name, 1)
    lines = [b"21S3FB         4.2301 IS900VET" + b" " * 23 + b"\r\n", b"31Sg00\r\n", b"21l1111\r\n"]
    data = b"".join(record + (lines[k % 3] if k % 5 == 4 else b"") for k, record in enumerate(capture.records))
    decoder = capture.decoder()
    events = merge_adjacent([*decoder.feed(data), *decoder.finish()])
    assert decoded_records(events, capture) == Counter(capture.records)
    assert not [event for event in events if isinstance(event, Garbage)]
    assert len(events) == 13, "a run of records is one event, and so is each reply"


@pytest.mark.parametrize("name", LISTS)
def test_rubbish_is_never_kept(name: str, rng: np.random.Generator) -> None:
    capture = make_capture(name, 1)
    decoder = capture.decoder()
    text = bytes(rng.choice(np.frombuffer(b"0123456789 .-\r\nABE", np.uint8), 1 << 16))
    for data in (rng.bytes(1 << 16), text, b"01 " * 20_000, b"2" * 50_000, b"0" * 50_000, b"2 E" + b"x" * 50_000):
        for start in range(0, len(data), 4096):
            decoder.feed(data[start : start + 4096])
            assert decoder.pending <= max(LONGEST_REPLY, capture.size + 3)
    assert (
        sum(
            (
                decoded_records([*decoder.feed(capture.data), *decoder.finish()], capture) & Counter(capture.records)
            ).values()
        )
        >= 30
    )


@pytest.mark.parametrize("min_mutations", [10_000, pytest.param(1_000_000, marks=pytest.mark.slow)])
def test_mutations_of_every_format(min_mutations: int) -> None:
    """Bytes lost, added, changed and repeated anywhere: no crash, bounded memory, most intact records arrive.

    A mutation costs at most one further record. Where mutations are close together, a few in a hundred cost more.
    """
    rng, mutations = np.random.default_rng(1), 0
    intact, arrived = Counter[str](), Counter[str]()
    while mutations < min_mutations:
        for name in LISTS:
            capture = make_capture(name, mutations % 7, 60)
            data, count = bytearray(capture.data), int(rng.integers(1, 400))
            for _ in range(count):
                at, kind = int(rng.integers(len(data))), int(rng.integers(4))
                if kind == 0:
                    del data[at]
                elif kind == 1:
                    data.insert(at, int(rng.integers(256)))
                elif kind == 2:
                    data[at] = int(rng.integers(256))
                else:
                    data[at : at + 20] = data[at : at + 20] * 2
            mutations += count
            decoder, events = capture.decoder(), []
            for start in range(0, len(data), 1000):
                events += decoder.feed(bytes(data[start : start + 1000]))
                assert decoder.pending <= max(LONGEST_REPLY, capture.size + 3)
            arrived_count = sum(
                (decoded_records([*events, *decoder.finish()], capture) & Counter(capture.records)).values()
            )
            expected = sum(record in data for record in capture.records)
            assert arrived_count >= max(expected - count, expected // 2), (name, count, expected, arrived_count)
            intact[name] += expected
            arrived[name] += arrived_count
    assert {name: share for name in LISTS if (share := arrived[name] / intact[name]) < 0.9} == {}


REPLIES = (
    b"21S3FB         4.2301 IS900VET" + b" " * 23 + b"\r\n",  # "01 " in it looks like the head of a record
    b"21O40 21121 1\r\n",
    b"21l1111" + b"0" * 28 + b"\r\n",
    b"31PTC0TC0TC0TC0X00X00X00X00X00X00X00X00   40  \r\n",
)
BESIDE = 2
"""Messages on each side of a damaged one that its damage may cost."""


def _lost_far_from_damage(name: str, seed: int, rounds: int) -> int:
    """Return how many undamaged records do not arrive although no message near them is damaged.

    Replies come between the records; one message in a hundred is damaged, and the bytes are read in random pieces.
    """
    rng, capture = np.random.default_rng([seed, 5]), make_capture(name, seed % 7, rounds)
    messages = list(capture.records)
    for at in np.sort(rng.integers(0, len(messages), len(messages) // 50))[::-1].tolist():
        messages.insert(at, REPLIES[at % len(REPLIES)])
    damaged = rng.random(len(messages)) < 0.01
    sent = [
        damage(message, KINDS[int(rng.integers(4))], int(rng.integers(len(message))), rng) if hit else message
        for message, hit in zip(messages, damaged.tolist(), strict=True)
    ]
    data, decoder, events = b"".join(sent), capture.decoder(), list[DecoderEvent]()
    pieces = int(rng.choice([20, 200, 2000]))
    cuts = [0, *sorted(rng.integers(1, len(data), len(data) // pieces).tolist()), len(data)]
    for start, stop in pairwise(cuts):
        events += decoder.feed(data[start:stop])
    decoded = decoded_records([*events, *decoder.finish()], capture)
    near = np.convolve(damaged, np.ones(2 * BESIDE + 1), "same") > 0
    return sum(
        message[:1] == b"0" and not decoded[message]
        for message, beside in zip(messages, near, strict=True)
        if not beside
    )


@pytest.mark.parametrize("name", LISTS)
def test_damage_costs_nothing_that_is_not_beside_it(name: str) -> None:
    assert sum(_lost_far_from_damage(name, seed, 100) for seed in range(3)) == 0


@pytest.mark.slow
def test_millions_of_records_arrive_whatever_happens_elsewhere() -> None:
    for name in LISTS:
        lost = sum(_lost_far_from_damage(name, seed, 2000) for seed in range(40))
        print(f"{name:16} {40 * 2000 * 4} records, {lost} lost far from damage", flush=True)
        assert lost == 0, name
