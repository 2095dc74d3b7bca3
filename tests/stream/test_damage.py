"""Damaged bytes, over all formats: what they cost, what is marked, and that nothing is ever kept or made up.

`make test-slow` tries a million; the table of docs/is900.md 5.6 is what `test_what_is_caught` prints then.
"""

from collections import Counter

import numpy as np
import pytest

from harness.stream.codec.decoder import LONGEST_REPLY, DecoderEvent, Garbage, RecordRun, merge_adjacent
from tests.stream.damage import FATES, KINDS, LISTS, Fate, Kind, cost, fate, fate_of_wrong_station, found, sound


def _costs(name: str, kind: Kind, trials: int) -> Counter[tuple[int, int]]:
    return Counter(cost(name, kind, trial) for trial in range(trials))


def _require_cheap(costs: Counter[tuple[int, int]], trials: int, what: object) -> None:
    """At most one record further, but for one trial in a thousand; nothing made up."""
    further = sum(count for (missing, _), count in costs.items() if missing > 1)
    made_up = sum(count for (_, extra), count in costs.items() if extra > 0)
    assert further <= trials / 1000, (what, costs)
    assert made_up <= trials / 1000, (what, costs)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", LISTS)
def test_a_damaged_byte_costs_its_record_and_at_most_one_further(name: str, kind: Kind) -> None:
    _require_cheap(_costs(name, kind, 200), 200, name)


@pytest.mark.slow
def test_a_million_damaged_bytes_cost_their_records_and_at_most_one_further_each() -> None:
    trials = 1_000_000 // (len(LISTS) * len(KINDS)) + 1
    for name in LISTS:
        for kind in KINDS:
            costs = _costs(name, kind, trials)
            print(f"{name:16} {kind:8} {trials} trials; further records lost: {_by_missing(costs)}", flush=True)
            _require_cheap(costs, trials, (name, kind))


def _by_missing(costs: Counter[tuple[int, int]]) -> dict[int, int]:
    out: Counter[int] = Counter()
    for (missing, _), count in costs.items():
        out[max(missing, 0)] += count
    return dict(sorted(out.items()))


@pytest.mark.parametrize("name", LISTS)
def test_what_is_caught(name: str) -> None:
    """A lost or added byte is always noticed, and so is most of what is changed in numbers written as text."""
    trials = 40
    shares = _fates(name, trials)
    for kind, fates in shares.items():
        passed = fates["large"] + fates["small"]
        if kind in ("lost", "added"):
            assert fates["large"] <= 1, shares
        else:
            assert passed <= (0.4 if name.startswith("ASCII") else 0.8) * trials, shares


@pytest.mark.parametrize("name", LISTS)
def test_a_wrong_station_is_always_marked(name: str) -> None:
    """A station's character changed into another's, in every list: order and time show it."""
    for trial in range(30):
        assert fate_of_wrong_station(name, trial) in ("suspect", "missing"), trial


@pytest.mark.slow
def test_what_is_caught_of_many() -> None:
    trials = 2000
    print(f"\n| List | Damage | {' | '.join(FATES)} |")
    for name in LISTS:
        for kind, fates in _fates(name, trials).items():
            print(f"| {name} | {kind} | " + " | ".join(f"{fates[f] / trials:.1%}" for f in FATES) + " |", flush=True)
            assert kind in ("flipped", "changed") or fates["large"] < trials / 500


def _fates(name: str, trials: int) -> dict[Kind, Counter[Fate]]:
    return {kind: Counter(fate(name, kind, trial) for trial in range(trials)) for kind in KINDS}


@pytest.mark.parametrize("name", LISTS)
def test_every_split_gives_the_same_events(name: str, rng: np.random.Generator) -> None:
    """Of records, replies between them, rubbish and a damaged byte."""
    given = sound(name, 3, 4)
    parts = [b"\x00noise01 0", *given.records]
    parts.insert(4, b"31PT81L00X00X00X00X00X00X00X00X00X00X00  120  \r\n")
    parts.insert(9, b"2 E*ERROR*x*ERROR* EC -99*PS1  *FL1 *ST0\r\n21O 2 4 1\r\n")
    parts.insert(12, b"\xff2 ")
    data = bytearray(b"".join(parts))
    data[11 * given.size + 5] ^= 0x11
    whole = _pieces(name, bytes(data), ())
    assert sum(isinstance(event, tuple) for event in whole) >= 1
    for cut in range(1, len(data)):
        assert _pieces(name, bytes(data), (cut,)) == whole, cut
    for _ in range(50):
        cuts = tuple(sorted(rng.integers(0, len(data), 9).tolist()))
        assert _pieces(name, bytes(data), cuts) == whole, cuts
    assert _pieces(name, bytes(data), tuple(range(1, len(data)))) == whole


def _pieces(name: str, data: bytes, cuts: tuple[int, ...]) -> list[object]:
    one = sound(name, 3, 4).decoder()
    events: list[DecoderEvent] = []
    for start, stop in zip((0, *cuts), (*cuts, len(data)), strict=True):
        events += one.feed(data[start:stop])
    out = merge_adjacent(events + one.finish())
    return [(e.offset, e.size, e.table.tobytes()) if isinstance(e, RecordRun) else e for e in out]


@pytest.mark.parametrize("name", LISTS)
def test_a_clean_stream_is_all_there_and_replies_are_found_between_records(name: str) -> None:
    given = sound(name, 1)
    lines = [b"21S3FB         4.2301 IS900VET" + b" " * 23 + b"\r\n", b"31Sg00\r\n", b"21l1111\r\n"]
    data = b"".join(record + (lines[k % 3] if k % 5 == 4 else b"") for k, record in enumerate(given.records))
    one = given.decoder()
    events = merge_adjacent([*one.feed(data), *one.finish()])
    assert found(events, given) == Counter(given.records)
    assert not [event for event in events if isinstance(event, Garbage)]
    assert len(events) == 13, "a run of records is one event, and each reply another"


@pytest.mark.parametrize("name", LISTS)
def test_rubbish_is_never_kept(name: str, rng: np.random.Generator) -> None:
    given = sound(name, 1)
    one = given.decoder()
    text = bytes(rng.choice(np.frombuffer(b"0123456789 .-\r\nABE", np.uint8), 1 << 16))
    for data in (rng.bytes(1 << 16), text, b"01 " * 20_000, b"2" * 50_000, b"0" * 50_000, b"2 E" + b"x" * 50_000):
        for start in range(0, len(data), 4096):
            one.feed(data[start : start + 4096])
            assert one.pending <= max(LONGEST_REPLY, given.size + 3)
    assert sum((found([*one.feed(given.data), *one.finish()], given) & Counter(given.records)).values()) >= 30


@pytest.mark.parametrize("wanted", [20_000, pytest.param(1_000_000, marks=pytest.mark.slow)])
def test_mutations_of_every_format(wanted: int) -> None:
    """Bytes lost, added, changed and repeated all over: no crash, nothing kept, most of what is intact arrives.

    A mutation costs one record further at most, and where they lie close together hardly more than a few in a hundred.
    """
    rng, mutations = np.random.default_rng(1), 0
    intact, arrived = Counter[str](), Counter[str]()
    while mutations < wanted:
        for name in LISTS:
            given = sound(name, mutations % 7, 60)
            data, count = bytearray(given.data), int(rng.integers(1, 400))
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
            one, events = given.decoder(), []
            for start in range(0, len(data), 1000):
                events += one.feed(bytes(data[start : start + 1000]))
                assert one.pending <= max(LONGEST_REPLY, given.size + 3)
            came = sum((found([*events, *one.finish()], given) & Counter(given.records)).values())
            whole = sum(record in data for record in given.records)
            assert came >= max(whole - count, whole // 2), (name, count, whole, came)
            intact[name] += whole
            arrived[name] += came
    assert {name: share for name in LISTS if (share := arrived[name] / intact[name]) < 0.9} == {}
