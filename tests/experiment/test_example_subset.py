"""Shares of a database: nested, of the right size, drawn by seed, and of consecutive frames."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from harness.core.motion import BodyMotion
from harness.errors import BadFile, BadInput
from harness.experiment.example_subset import PIECE_S, keep_share
from harness.experiment.scenarios.scenario_reader import load_scenario
from tests.experiment.test_thinning import takes

SHARES = (0.01, 0.03, 0.1, 0.3, 1.0)


def numbers(kept: list[BodyMotion]) -> set[int]:
    """The frames by the numbers that `takes` gives them."""
    return {int(x) for take in kept for x in take.qpos[:, 0]}


@pytest.mark.parametrize("lengths", [(800,) * 8, (1500, 7, 20, 39, 900)])
def test_smaller_shares_are_subsets_of_larger_ones(lengths: tuple[int, ...]) -> None:
    whole = takes(*lengths)
    kept = [keep_share(whole, share, 1) for share in SHARES]
    for less, more in pairwise(kept):
        assert numbers(less) < numbers(more)
    for share, some in zip(SHARES, kept, strict=True):
        count = sum(map(len, some))
        assert len(numbers(some)) == count
        assert 0 <= count - share * sum(lengths) < 2.0 * PIECE_S * 40.0
    assert kept[-1] == whole


def test_pieces_are_of_consecutive_frames_at_the_rate_of_their_take() -> None:
    for take in keep_share(takes(400, 400), 0.2, 1):
        assert set(np.diff(take.qpos[:, 0])) == {1.0}
        assert len(take) >= PIECE_S * 40.0
        assert take.rate_hz == 40.0


def test_another_seed_draws_others_and_the_same_the_same() -> None:
    whole = takes(800, 800)
    assert numbers(keep_share(whole, 0.1, 1)) == numbers(keep_share(whole, 0.1, 1))
    assert numbers(keep_share(whole, 0.1, 1)) != numbers(keep_share(whole, 0.1, 2))


def test_pieces_are_spread_over_the_takes() -> None:
    kept = keep_share(takes(*(400,) * 10), 0.3, 1)
    assert len({take.name for take in kept}) >= 9


@pytest.mark.parametrize("share", [0.0, -0.1, 1.1, float("nan")])
def test_what_is_no_share_is_refused(share: float, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="example_share"):
        keep_share(takes(10), share, 1)
    file = tmp_path / "own.toml"
    text = 'schema = 1\nmethods = ["ik"]\nstations = "liu2011"\n[motion]\nsource = "builtin"\n'
    file.write_text(f'{text}test = ["walking_p1_01"]\nbehaviours = ["walking"]\nexample_share = {share}\n')
    with pytest.raises(BadFile, match="example_share"):
        load_scenario(file)
