"""The bound spares correlations and changes no result."""

import numpy as np
import pytest

from harness.core.arrays import Singles
from harness.mocap import motion_correlation
from harness.mocap.motion_correlation import EVERY, WINDOWS, FirstClip, best_match

WIDTH = 24
UPPER = np.arange(10, WIDTH)


def smooth_changes(rng: np.random.Generator, moments: int) -> Singles:
    """(moments, 2, 24) changes that move much, with a few waves in each column."""
    waves = rng.normal(size=(12, 2, WIDTH)) / np.arange(1, 13)[:, None, None]
    phases = np.linspace(0.0, 3.0, moments)[:, None] * np.arange(1, 13)
    out: Singles = np.einsum("nk,kce->nce", np.sin(phases), waves).astype(np.float32)
    return out


def least_share(first: Singles, second: Singles) -> float:
    """The least loss of correlation of any two windows relative to its limit, without a bound."""
    shares = []
    for window in WINDOWS:
        columns = UPPER if window.part.upper_body else np.arange(WIDTH)
        mine, theirs = (x[..., int(window.part.acceleration), :][..., columns].astype(float) for x in (first, second))
        starts, rows = len(mine) - (window.samples - 1) * EVERY, theirs.shape[1] - window.samples + 1
        own = np.array([mine[s : s + window.samples * EVERY : EVERY].ravel() for s in range(starts)])
        other = np.array([side[r : r + window.samples].ravel() for side in theirs for r in range(rows)])
        own, other = (x / np.linalg.norm(x, axis=1, keepdims=True) for x in (own, other))
        shares.append(float(1.0 - (own @ other.T).max()) / window.largest_loss)
    return min(shares)


@pytest.mark.parametrize("at_a_time", [4_000_000, 500])
@pytest.mark.parametrize("noise", [0.0, 0.02, 1.0])
def test_the_best_match_is_that_of_all_pairs(
    rng: np.random.Generator, noise: float, at_a_time: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(motion_correlation, "_BOUNDED", at_a_time)
    moments = 340
    first, other = smooth_changes(rng, moments), smooth_changes(rng, 420)
    other[:moments] = (1.0 - noise) * first + noise * other[:moments]
    second = np.stack([other[::-1][::EVERY], other[::EVERY]])
    match = best_match(FirstClip(first, UPPER), range(moments), second, np.ones(second.shape[1], bool), np.inf)
    assert match is not None
    assert match.share == pytest.approx(least_share(first, second), abs=1e-3)


@pytest.mark.parametrize("moments", [1, 9, 50])
def test_a_clip_that_is_shorter_than_every_window_matches_nothing(rng: np.random.Generator, moments: int) -> None:
    first, second = smooth_changes(rng, moments), smooth_changes(rng, 400)
    sides = np.stack([second[::EVERY]] * 2), np.stack([first[::EVERY]] * 2)
    for one, other in zip((first, second), sides, strict=True):
        allowed = np.ones(other.shape[1], bool)
        assert best_match(FirstClip(one, UPPER), range(len(one)), other, allowed, np.inf) is None
