"""A test clip is never among its own examples, under any split."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.core.split import ClipPart, allowed_frames, refuse_leak, select_examples
from harness.errors import BadInput

SUBJECTS = {"13_17": "13", "13_30": "13", "14_02": "14"}


def test_a_sequence_is_left_out() -> None:
    assert select_examples(ClipPart("13_17"), SUBJECTS, "sequence", SUBJECTS) == ["13_30", "14_02"]
    placed = {"60hz/13_17": "13", "120hz/13_17": "13", "Anna/take_001": "Anna", "Bert/take_001": "Bert"}
    assert select_examples(ClipPart("60hz/13_17"), placed, "sequence", placed) == ["Anna/take_001", "Bert/take_001"]
    assert select_examples(ClipPart("60hz/13_17"), placed, "block", placed)[0] == "60hz/13_17"
    assert "120hz/13_17" not in select_examples(ClipPart("60hz/13_17"), placed, "block", placed)
    assert "Bert/take_001" in select_examples(ClipPart("Anna/take_001"), placed, "sequence", placed)


def test_a_subject_is_left_out() -> None:
    assert select_examples(ClipPart("13_17"), SUBJECTS, "subject", SUBJECTS) == ["14_02"]


def test_a_block_keeps_the_rest_of_its_take_a_second_away() -> None:
    part = ClipPart.parse("13_17@0.40-0.60")
    runs = allowed_frames([part], "13_17", 1000, 40.0)
    assert runs == [range(0, 360), range(640, 1000)]
    refuse_leak([part], "13_17", runs, 1000, 40.0)


def test_what_is_withheld_is_left_out_like_what_is_judged() -> None:
    """Test blocks stay unseen while constants are chosen on other blocks of the same takes."""
    closed = [ClipPart.parse(text) for text in ("13_17@0.80-0.90", "13_17@0.20-0.40", "13_17@0.60-0.70", "14_02")]
    runs = allowed_frames(closed, "13_17", 1000, 40.0)
    assert runs == [range(0, 160), range(440, 560), range(740, 760), range(940, 1000)]
    assert allowed_frames(closed, "14_02", 1000, 40.0) == []
    assert allowed_frames(closed, "02_05", 1000, 40.0) == [range(1000)]


@given(st.lists(st.tuples(st.floats(0.0, 0.95), st.floats(0.01, 0.5)), max_size=4), st.integers(2, 3000))
def test_learnt_frames_are_all_that_are_far_from_every_closed_part(shares: list[tuple[float, float]], n: int) -> None:
    closed = [ClipPart("a_1", start, min(start + length, 1.0)) for start, length in shares]
    runs = allowed_frames(closed, "a_1", n, 40.0)
    learnt = {frame for run in runs for frame in run}
    far = {k for k in range(n) if all(k < p.frames(n).start - 40 or k >= p.frames(n).stop + 40 for p in closed)}
    assert sum(map(len, runs)) == len(learnt)
    assert learnt <= far
    assert all(frame - 1 not in far and frame + 1 not in far for frame in far - learnt)  # single frames are no motion
    refuse_leak(closed, "a_1", runs, n, 40.0)


@given(st.floats(0, 0.9), st.floats(0.01, 1.0), st.integers(2, 5000), st.integers(0, 5000), st.integers(1, 3000))
def test_a_leak_is_refused(start: float, length: float, count: int, first: int, run: int) -> None:
    part = ClipPart("a_1", start, min(start + length, 1.0))
    learnt = range(first, first + run)
    tested = part.frames(count)
    near = learnt.start < tested.stop + 40 and learnt.stop > tested.start - 40
    if near:
        with pytest.raises(BadInput, match="own examples"):
            refuse_leak([part], "a_1", [learnt], count, 40.0)
    else:
        refuse_leak([part], "a_1", [learnt], count, 40.0)


def test_a_whole_take_leaves_nothing_to_learn_from() -> None:
    assert allowed_frames([ClipPart("13_17")], "13_17", 1000, 40.0) == []


@pytest.mark.parametrize("text", ["a@", "a@0.5", "a@0.6-0.4", "a@x-y", "a@0.5-1.5", "a@.-."])
def test_a_part_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(BadInput, match="CLIP@"):
        ClipPart.parse(text)


def test_a_part_prints_as_it_was_written() -> None:
    for text in ("13_17", "13_17@0.20-0.40", "13_17@0.204-0.40"):
        assert str(ClipPart.parse(text)) == text


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_part_is_told_by_its_name(one: float, other: float) -> None:
    """Cells are kept by it: parts that print alike would share results."""
    if one != other:
        part = ClipPart("a_1", min(one, other), max(one, other))
        assert ClipPart.parse(str(part)) == part
