"""Copies of a clip are found whatever was done to them; different takes, and the rest of one take, share nothing."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations, permutations
from pathlib import Path

import numpy as np
import pytest

from harness.core.motion import Clip
from harness.core.split import ClipPart, allowed_frames, forbidden_frames
from harness.mocap import synthetic
from harness.mocap.clip_file import read_clip
from harness.mocap.library import MotionLibrary
from harness.mocap.shared_motion import (
    SAME_MOTION,
    SharedMotion,
    best_match_of_clips,
    compare_poses,
    find_shared_motion,
)
from tests.mocap.clip_copies import COPIES, EDITS, mirrored, resampled, take_rows

TAKES = [("walking", "p1", 1), ("boxing", "p2", 1), ("jumping", "p3", 2), ("golf", "p1", 2), ("table_tennis", "p2", 1)]


def complete(clip: Clip) -> list[range]:
    return [range(len(clip))]


def shared(first: Clip, second: Clip) -> SharedMotion | None:
    return find_shared_motion(first, complete(first), second, complete(second))


def least_difference(first: Clip, first_runs: Sequence[range], second: Clip, second_runs: Sequence[range]) -> float:
    """Least difference of two clips over a second that moves, as `SAME_MOTION` bounds it; inf if it is large."""
    comparisons = compare_poses(first, first_runs, second, second_runs)
    return min((float(c.difference[c.moving].min(initial=np.inf)) for c in comparisons), default=np.inf)


def least_loss(
    first: Clip, first_runs: Sequence[range], second: Clip, second_runs: Sequence[range], limit: float
) -> float:
    """Least loss of correlation, relative to the largest one of a copy; inf if none is below the limit."""
    match = best_match_of_clips(first, first_runs, second, second_runs, limit)
    return match.share if match else np.inf


@cache
def generated(behaviour: str, performer: str, take: int, seed: int = 1) -> Clip:
    return synthetic.generate(behaviour, performer, take, seed=seed, duration_s=10.0)


@pytest.mark.parametrize("copy", COPIES)
@pytest.mark.parametrize("take", TAKES)
def test_an_edited_copy_is_found(copy: str, take: tuple[str, str, int]) -> None:
    clip = generated(*take)
    edited = COPIES[copy](clip)
    assert shared(clip, edited) is not None
    assert shared(edited, clip) is not None


FOUND = (
    *("1 deg of drift", "1 deg of noise of 0.4 s", "2 deg of noise of 0.4 s", "1 deg of noise of 0.15 s"),
    *("rounded to 1 deg", "0.9 of the amplitude", "angles times 0.95", "other legs", "pieces of 0.8 s"),
    *("mirrored", "reversed", "50 Hz", "moved and turned", "3 % slower", "pieces of 0.8 s in another order"),
    *("0.05 of another take", "jitter of a frame", "filtered with 0.05 s"),
)
"""Edits that are found in every one of `TAKES`; docs/notes/copies.md says the same."""
NOT_FOUND = (
    *("4 deg of noise of 0.4 s", "rounded to 4 deg", "0.7 of the amplitude", "20 deg added to the arms"),
    *("half of another take", "0.9 of the amplitude, rounded to 1 deg, 60 Hz, mirrored"),
)
"""Edits that are found in none. The other ones are found in some."""


@pytest.mark.long
def test_the_table_of_edits_holds() -> None:
    """It shows how near each edit is to the limits of the two searches, 1.00; above both a copy is not found."""
    clips = [generated(*take) for take in TAKES]
    for name, edit in EDITS.items():
        pairs = [(clip, complete(clip), copy, complete(copy)) for clip in clips for copy in [edit(clip)]]
        found = [shared(pair[0], pair[2]) is not None and shared(pair[2], pair[0]) is not None for pair in pairs]
        shares = " ".join(
            f"{least_difference(*pair) / SAME_MOTION:5.2f} {least_loss(*pair, limit=10.0):5.2f}  " for pair in pairs
        )
        print(f"{name:56} {sum(found)} of {len(TAKES)}: {shares}")
        assert (name in FOUND, name in NOT_FOUND) == (all(found), not any(found)), name


def test_the_times_of_an_edited_copy_say_where_the_clips_agree() -> None:
    clip = generated("boxing", "p2", 1)
    part = EDITS["rounded to 1 deg"](take_rows(clip, np.arange(240, 721)))
    found = shared(clip, part)
    assert found is not None
    assert found.first_s[0] - found.second_s[0] == pytest.approx(2.0, abs=0.02)


def least_losses(clips: Sequence[Clip]) -> tuple[float, str]:
    """The least loss below 3 of two different takes, or of a fifth of a take and its guard to the rest; inf if none."""
    found = [
        (least_loss(a, complete(a), b, complete(b), 3.0), f"{a.name} and {b.name}") for a, b in combinations(clips, 2)
    ]
    for clip in clips:
        for start, end in FIFTHS:
            part = ClipPart(clip.name, start, end)
            forbidden = forbidden_frames(part, "block", len(clip), clip.rate_hz)
            rest = allowed_frames([part], clip.name, len(clip), clip.rate_hz)
            found.append((least_loss(clip, [forbidden], clip, rest, 3.0), str(part)))
    return min(found)


def test_the_times_say_where_the_clips_agree() -> None:
    """The copy begins 2 s into the clip, and runs for 4 s at another rate."""
    clip = generated("boxing", "p2", 1)
    found = shared(clip, resampled(take_rows(clip, np.arange(240, 721)), 60.0))
    assert found is not None
    assert found.first_s == pytest.approx((2.0, 6.0), abs=0.11)
    assert found.second_s == pytest.approx((0.0, 4.0), abs=0.11)
    assert not found.mirrored


def test_a_mirrored_copy_is_called_mirrored() -> None:
    clip = generated("boxing", "p2", 1)
    found = shared(clip, mirrored(clip))
    assert found is not None
    assert found.mirrored


def test_one_second_is_found_and_less_is_not_sought() -> None:
    """The clip goes on for another second after the part; a fifth of a second of it is no stretch."""
    clip = generated("boxing", "p2", 1)
    for end, expected in ((480, True), (384, False)):
        assert (find_shared_motion(clip, [range(360, end)], clip, [range(360, 480)]) is not None) is expected


def test_a_copy_shorter_than_a_second_is_found() -> None:
    clip = generated("boxing", "p2", 1)
    assert shared(clip, take_rows(clip, np.arange(300, 372))) is not None


def test_people_who_stand_share_nothing() -> None:
    """A pose that is held is the same in every clip, and reveals nothing."""
    clip = generated("boxing", "p2", 1)
    still = take_rows(clip, np.full(600, 100))
    assert shared(still, take_rows(still, np.arange(1, 600))) is None


def test_a_block_shares_nothing_with_the_rest_of_its_take_but_without_guard_it_does() -> None:
    clip, part = generated("walking", "p1", 1), ClipPart("walking_p1_01", 0.4, 0.6)
    forbidden = forbidden_frames(part, "block", len(clip), clip.rate_hz)
    assert forbidden == range(480 - 120, 721 + 120)
    rest = allowed_frames([part], clip.name, len(clip), clip.rate_hz)
    assert find_shared_motion(clip, [forbidden], clip, rest) is None
    assert find_shared_motion(clip, [forbidden], clip, [range(400)]) is None  # a third of a second of the guard
    assert find_shared_motion(clip, [forbidden], clip, [range(600)]) is not None


def least_of_takes(clips: Sequence[Clip]) -> tuple[float, str, str]:
    """The least difference of two different takes, and their names."""
    found = [(least_difference(a, complete(a), b, complete(b)), a.name, b.name) for a, b in permutations(clips, 2)]
    return min(found)


def least_of_blocks(clips: Iterable[Clip], shares: Sequence[tuple[float, float]]) -> tuple[float, str]:
    """The least difference of a block and its guard to the rest of its own take, and the block's name."""
    found = [(np.inf, "")]
    for clip in clips:
        for start, end in shares:
            part = ClipPart(clip.name, start, end)
            forbidden = forbidden_frames(part, "block", len(clip), clip.rate_hz)
            rest = allowed_frames([part], clip.name, len(clip), clip.rate_hz)
            found.append((least_difference(clip, [forbidden], clip, rest), str(part)))
    return min(found)


def most_of_copies(clips: Sequence[Clip]) -> tuple[float, str, str]:
    """The largest difference of a clip to an edited copy that moves for a second."""
    found = [
        (difference, name, clip.name)
        for name, make in COPIES.items()
        for clip in clips
        for copy in [make(clip)]
        if np.isfinite(difference := least_difference(clip, complete(clip), copy, complete(copy)))
    ]
    return max(found)


FIFTHS = [(start / 5, (start + 1) / 5) for start in range(5)]


@pytest.mark.parametrize(
    "behaviour", [b if b == "golf" else pytest.param(b, marks=pytest.mark.slow) for b in synthetic.BEHAVIOURS]
)
def test_takes_of_the_motion_generator_are_apart(behaviour: str) -> None:
    """Takes and seeds of four people: copies differ by less than half the threshold, takes by more than twice."""
    others = [(performer, 1, 1) for performer in ("p6", "p30", "p57")]
    clips = [
        replace(synthetic.generate(behaviour, performer, take, seed=seed), name=f"{performer}_{take} of seed {seed}")
        for performer, take, seed in (*(("p1", take, seed) for take in (1, 2) for seed in (1, 2)), *others)
    ]
    copies, takes, blocks = most_of_copies(clips[:2]), least_of_takes(clips), least_of_blocks(clips, FIFTHS)
    losses = least_losses(clips)
    print(f"{behaviour}: copies up to {copies}, takes from {takes}, blocks from {blocks}, losses from {losses}")
    assert losses[0] > 1.5
    assert 2.0 * copies[0] < SAME_MOTION < 0.5 * min(takes[0], blocks[0])


@pytest.mark.slow
def test_takes_of_one_subject_of_the_library_are_apart(mocap: Path) -> None:
    """The performers with the most similar clips; `test_no_two_takes_of_the_library_are_refused` has all of them."""
    library = MotionLibrary(mocap)
    clips = [library.load(name) for name in library.names() if library.entry(name).subject in ("08", "13", "14")]
    assert len(clips) > 10
    copies, takes, blocks = most_of_copies(clips[:3]), least_of_takes(clips), least_of_blocks(clips, FIFTHS)
    losses = least_losses(clips)
    print(f"copies up to {copies}, takes from {takes}, blocks from {blocks}, losses from {losses}")
    assert losses[0] > 1.5
    assert 2.0 * copies[0] < SAME_MOTION < 0.5 * min(takes[0], blocks[0])


@pytest.mark.slow
def test_no_two_takes_of_the_library_are_refused(mocap: Path) -> None:
    library = MotionLibrary(mocap)
    clips = [library.load(name) for name in library.names()]
    assert len(clips) > 100
    tenths = [(start / 10, (start + 1) / 10) for start in range(10)]
    copies, takes, blocks = most_of_copies(clips), least_of_takes(clips), least_of_blocks(clips, [*FIFTHS, *tenths])
    losses = least_losses(clips)
    print(f"{len(clips)} clips: copies up to {copies}, takes {takes}, blocks {blocks}, losses from {losses}")
    assert losses[0] > 1.0
    assert 2.0 * copies[0] < SAME_MOTION < 0.5 * min(takes[0], blocks[0])


def test_the_bvh_copy_of_an_amc_clip_is_found(mocap: Path) -> None:
    """Another format, another skeleton and an added T-pose."""
    library, bvh = MotionLibrary(mocap), sorted((mocap / "bvh").rglob("*.bvh"))
    assert bvh
    for path in bvh:
        copy = read_clip(path)
        assert shared(library.load(copy.name), copy) is not None, copy.name
