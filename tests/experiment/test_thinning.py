"""Sparse databases: so many frames of all examples, evenly spaced."""

from itertools import pairwise

import numpy as np
import pytest

from harness.core.motion import BodyMotion
from harness.errors import BadInput
from harness.experiment.clip_evaluation import thin_takes


def takes(*lengths: int) -> list[BodyMotion]:
    """Each frame is numbered in its first coordinate, on from take to take."""
    starts = np.cumsum([0, *lengths])
    numbered = [np.repeat(np.arange(a, b, dtype=float)[:, None], 55, axis=1) for a, b in pairwise(starts)]
    return [BodyMotion(f"take_{k}", "nobody", "numbers", "", 40.0, qpos) for k, qpos in enumerate(numbered)]


@pytest.mark.parametrize("lengths", [(100,), (3, 1, 200, 40), (43,), (86, 7)])
def test_frames_are_as_many_as_asked_for_and_evenly_spaced_across_takes(lengths: tuple[int, ...]) -> None:
    kept = thin_takes(takes(*lengths), 43)
    every = sum(lengths) // 43
    frames = np.concatenate([take.qpos[:, 0] for take in kept])
    assert len(frames) == 43
    assert set(np.diff(frames)) == {float(every)}
    assert {take.rate_hz for take in kept} == {40.0 / every}


def test_zero_keeps_everything_and_too_many_are_refused() -> None:
    whole = takes(10, 20)
    assert thin_takes(whole, 0) == whole
    with pytest.raises(BadInput, match="thin_to"):
        thin_takes(whole, 31)
    with pytest.raises(BadInput, match="thin_to"):
        thin_takes(whole, -1)
